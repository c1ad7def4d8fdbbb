//! An attribute refers to a sample of a topic, beside a type with this name; run by `tests/compile.rs`.

use awkward_generated::world::{Edit, Sample, View};

/// Sets the reference.
fn set(edit: &mut Edit<'_>, to: Sample) -> bool {
    let edge = edit.self_("one", "other");
    edge.is_ok_and(|mut edge| edge.set_set(to).is_ok())
}

/// The topic of the reference.
fn topic(now: &View) -> Option<&str> {
    let edge = now.self_("one", "other").ok()??;
    edge.set().map(|sample| sample.topic.as_str())
}

#[test]
fn a_reference_has_a_type_that_workers_can_name() {
    let _: [fn(&mut Edit<'_>, Sample) -> bool; 1] = [set];
    let _: [fn(&View) -> Option<&str>; 1] = [topic];
    let number = Sample {
        topic: "laser.scan".to_owned(),
        kind: "Laser::Scan".to_owned(),
        sequence: 7,
    };
    assert_eq!(number.sequence, 7);
}
