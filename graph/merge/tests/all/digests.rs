//! The bytes of digests are defined: another implementation has the same numbers.

use graph_merge::Replica;
use property_graph::{Sample, Value};

/// The expected numbers come from a script in Python that does what the documentation of `digest` says.
#[test]
fn digests_are_over_defined_bytes() {
    let mut replica = Replica::new(7, []);
    let (a, b) = (
        replica.add_node("thing").expect("a stamp"),
        replica.add_node("thing").expect("a stamp"),
    );
    replica.add_edge("in", a, b).expect("a stamp");
    let sample = Sample {
        topic: "cam".to_owned(),
        kind: "T".to_owned(),
        sequence: u64::MAX,
    };
    let values: [(&str, Option<Value>); 10] = [
        ("bool", Some(true.into())),
        ("int", Some((-5_i64).into())),
        ("float", Some(0.5.into())),
        ("text", Some("größe".into())),
        ("bytes", Some([1_u8, 2, 255].as_slice().into())),
        ("ints", Some(Value::Ints([1, -1].into()))),
        ("floats", Some([-0.0, 2.5].into())),
        ("texts", Some(Value::Texts(["a".into(), "".into()].into()))),
        ("sample", Some(sample.into())),
        ("gone", None),
    ];
    for (name, value) in values {
        assert_eq!(replica.set(a, name, value), Ok(true));
    }
    let expected: [u64; 4] = [
        0x0dd4_db0c_d3df_8aa8,
        0xf7a9_8b4c_4905_0689,
        0x0000_0000_0000_0000,
        0xd250_f1c2_4438_ac2c,
    ];
    assert_eq!(replica.digests(4), expected);
    assert_eq!(
        replica.digests(1),
        [expected.into_iter().fold(0, u64::wrapping_add)]
    );
}
