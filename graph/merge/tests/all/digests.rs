//! The bytes of digests are defined: another implementation has the same numbers.

use graph_merge::Replica;
use property_graph::{Sample, Value};

fn fnv(bytes: &[u8]) -> u64 {
    let start = 0xcbf2_9ce4_8422_2325;
    let add = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(start, add)
}

fn numbers(all: &[u64]) -> Vec<u8> {
    all.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn text(text: &str) -> Vec<u8> {
    [&numbers(&[text.len() as u64]), text.as_bytes()].concat()
}

/// An id, the lower half first.
fn id(sequence: u64) -> Vec<u8> {
    numbers(&[sequence, 7])
}

/// The expected bytes are written down here as the documentation of `digest` defines them.
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
    let minus_one = u64::MAX;
    // In the order of their names, with the sequence of their change.
    let attributes: [(&str, u64, Vec<u8>); 10] = [
        ("bool", 4, vec![1, 1]),
        (
            "bytes",
            8,
            [vec![5], numbers(&[3]), vec![1, 2, 255]].concat(),
        ),
        ("float", 6, [vec![3], numbers(&[0x3fe0 << 48])].concat()),
        (
            "floats",
            10,
            [vec![7], numbers(&[2, 1 << 63, 0x4004 << 48])].concat(),
        ),
        ("gone", 13, vec![0]),
        ("int", 5, [vec![2], numbers(&[minus_one - 4])].concat()),
        ("ints", 9, [vec![6], numbers(&[2, 1, minus_one])].concat()),
        (
            "sample",
            12,
            [vec![9], text("cam"), text("T"), numbers(&[u64::MAX])].concat(),
        ),
        ("text", 7, [vec![4], text("größe")].concat()),
        (
            "texts",
            11,
            [vec![8], numbers(&[2]), text("a"), text("")].concat(),
        ),
    ];
    let stamp = |sequence| numbers(&[sequence, 7, sequence]);
    let mut first = [id(1), vec![0], text("thing"), stamp(1)].concat();
    for (name, sequence, value) in attributes {
        first.extend([text(name), stamp(sequence), value].concat());
    }
    let second = [id(2), vec![0], text("thing"), stamp(2)].concat();
    let edge = [id(3), vec![1], text("in"), id(1), id(2), stamp(3)].concat();
    let mut expected = [0_u64; 4];
    for (sequence, bytes) in [(1, first), (2, second), (3, edge)] {
        let digest = &mut expected[(fnv(&id(sequence)) % 4) as usize];
        *digest = digest.wrapping_add(fnv(&bytes));
    }
    assert_eq!(replica.digests(4), expected);
    assert_eq!(
        replica.digests(1),
        [expected.into_iter().fold(0, u64::wrapping_add)]
    );
}
