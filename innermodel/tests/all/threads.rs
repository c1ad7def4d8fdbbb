//! Readers and a writer at the same time.

use crate::load;
use innermodel::{InnerModel, Point, Pose, Time};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// The tray moves to the right by as much as the cup on it moves to the left.
#[test]
fn eight_readers_never_see_half_a_change() {
    let model = InnerModel::parse(
        r#"<innerModel><transform id="world"><transform id="tray"><transform id="cup">
            <joint id="lid" axis="x"/></transform></transform></transform></innerModel>"#,
    )
    .expect("a model");
    let (reads, done) = (AtomicU64::new(0), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let readers: Vec<_> = (0..8)
            .map(|_| {
                scope.spawn(|| {
                    let mut seen = 0;
                    for _ in 0..125_000 {
                        let tree = model.snapshot();
                        let cup = tree.transform("world", Point::origin(), "cup");
                        assert_eq!(cup, Ok(Point::origin()));
                        assert!(tree.version() >= seen);
                        seen = tree.version();
                        reads.fetch_add(1, Ordering::Relaxed);
                    }
                })
            })
            .collect();
        scope.spawn(|| {
            let mut x = 0.0;
            while !done.load(Ordering::Relaxed) {
                x += 1.0;
                model
                    .change(Time::ZERO, |edit| {
                        edit.set_pose("tray", Pose::new(x, 0.0, 0.0, 0.0, 0.0, 0.0))?;
                        edit.set_pose("cup", Pose::new(-x, 0.0, 0.0, 0.0, 0.0, 0.0))?;
                        edit.set_joint("lid", x)
                    })
                    .expect("a change");
            }
        });
        let ends: Vec<_> = readers
            .into_iter()
            .map(std::thread::ScopedJoinHandle::join)
            .collect();
        done.store(true, Ordering::Relaxed);
        assert!(ends.iter().all(Result::is_ok));
    });
    assert_eq!(reads.into_inner(), 1_000_000);
}

#[test]
fn a_transform_allocates_nothing() {
    let model = load("house.xml");
    let pan = model.snapshot().node("pan").expect("a node").node_id();
    let allocations = allocation_counter::measure(|| {
        let tree = model.snapshot();
        for _ in 0..100 {
            for to in ["camera", "root", "bowl"] {
                let moved = tree.transform(to, Point::new(1.0, 2.0, 3.0), "laser");
                assert!(moved.is_ok() && tree.pose(to, pan).is_ok());
                assert!(tree.matrix(pan, to).is_ok());
            }
        }
    });
    assert_eq!(allocations.count_total, 0);
}
