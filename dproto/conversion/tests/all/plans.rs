//! The texts of plans.

use rc_conversion::{
    Formula, Frame, Item, LONGEST, Move, Operand, Operation, Part, Place, Plan, Step,
};
use rc_quantity::Unit;
use rc_vocabulary::Primitive;

fn conversion(from: &str, to: &str) -> rc_quantity::Conversion {
    let [from, to] = [from, to].map(|text| Unit::parse(text).expect("a unit"));
    from.conversion_to(&to).expect("a conversion")
}

#[test]
fn a_plan_is_printed_and_read_again() {
    let items = vec![
        Item::Text,
        Item::Numbers(3, Primitive::F64, None),
        Item::Sequence(vec![
            Item::Numbers(1, Primitive::F32, Some(conversion("mm", "m"))),
            Item::Array(2, vec![Item::Text, Item::Numbers(1, Primitive::U8, None)]),
        ]),
        Item::Bytes(12),
        Item::Bounded {
            bound: 16,
            padding: 4,
            stride: 24,
            items: vec![Item::Numbers(
                1,
                Primitive::I16,
                Some(conversion("°C", "°F")),
            )],
        },
    ];
    let part = |operation, place| Part {
        operation,
        place,
        moves: Vec::new(),
        items: items.clone(),
    };
    let plan = Plan {
        parts: vec![
            part(0, Place::Input),
            part(0, Place::InputImage),
            part(2, Place::Output),
            part(2, Place::OutputImage),
            part(2, Place::Exception(7)),
        ],
    };
    let text = plan.to_string();
    assert!(
        text.starts_with("0i:s3d[f{1/1000}2(sB)]12x16<4,24:h{9/5+32}>,0I:s"),
        "{text}"
    );
    assert_eq!(text.parse(), Ok(plan));
}

#[test]
fn a_formula_is_printed_and_read_again() {
    let steps = [0.1, -1e300, f64::MIN_POSITIVE, 1e3, f64::INFINITY].map(|constant| Step {
        operation: Operation::Multiply,
        operands: vec![Operand::Input(2), Operand::Constant(constant.to_bits())],
    });
    let group = Item::Group {
        items: vec![Item::Text, Item::Marked(3, Primitive::F32), Item::Bytes(4)],
        formula: Formula {
            steps: steps.to_vec(),
            outputs: vec![Operand::Step(1), Operand::Input(0), Operand::Step(4)],
            locks: vec![Operand::Step(2)],
        },
    };
    let plan = Plan {
        parts: vec![Part {
            operation: 0,
            place: Place::Input,
            moves: Vec::new(),
            items: vec![Item::Sequence(vec![group])],
        }],
    };
    let text = plan.to_string();
    assert!(
        text.starts_with("0i:[{s3f!4x|m@2&1e-1;m@2&-1e300;"),
        "{text}"
    );
    assert_eq!(text.parse(), Ok(plan));
}

#[test]
fn changes_of_frames_are_printed_and_read_again() {
    let text = "0i^lidar>map@0*1000000000+1*1^$0>odom@2*1000:iI?q?s?{3d!|m^0&@0;=$0&^3&^23}";
    let refused = text.parse::<Plan>();
    assert!(refused.is_err(), "only two numbers are kept");
    let text = "0i^lidar>map@0*1000000000+1*1^$0>odom@2*1000:i?I?q?s?{3d!|m^0&@0;=$0&^3&^23}";
    let plan: Plan = text.parse().expect("a plan");
    assert_eq!(plan.to_string(), text);
    assert_eq!(
        plan.parts[0].moves,
        [
            Move {
                from: Frame::Named("lidar".to_owned()),
                to: "map".to_owned(),
                stamp: vec![(0, 1_000_000_000), (1, 1)],
            },
            Move {
                from: Frame::Kept(0),
                to: "odom".to_owned(),
                stamp: vec![(2, 1000)],
            },
        ]
    );
}

#[test]
fn a_text_that_is_no_plan_is_refused_at_its_place() {
    let deep = format!("0i:{}", "[".repeat(40));
    let long = format!("0i:{}", "f".repeat(LONGEST));
    let cases = [
        ("", "expected a number at byte 0"),
        ("0", "expected `i`, `I`, `o`, `O` or `e` at byte 1"),
        ("0i", "expected `^` or `:` at byte 2"),
        ("0i:0f", "expected a number above 0 at byte 4"),
        (
            "0i:f{mm}",
            "expected a conversion such as `1/1000}` at byte 5",
        ),
        (
            "0i:f{1",
            "expected a conversion such as `1/1000}` at byte 5",
        ),
        ("0i:z", "expected a value at byte 3"),
        ("0i:[f", "expected a value or `]` at byte 5"),
        ("0i:2<4,0:f{2}>", "expected a stride above 0 at byte 8"),
        ("0i:4294967296f", "expected a number below 2^32 at byte 3"),
        ("0i:f]", "expected `,` or the end at byte 4"),
        ("0i:f,", "expected a number at byte 5"),
        ("0i:[f!]", "expected a value at byte 5"),
        ("0i:{f!", "expected a value or `|` at byte 6"),
        ("0i:{f!|x@0;=@0}", "expected an operation or `=` at byte 7"),
        (
            "0i:{f!|a@0;=@0}",
            "expected the operands of the operation at byte 10",
        ),
        (
            "0i:{f!|n@0;=$1}",
            "expected a formula of the numbers of the group at byte 7",
        ),
        (
            "0i:{f!|n$0;=@0}",
            "expected a formula of the numbers of the group at byte 7",
        ),
        (
            "0i:{2f!|=@0}",
            "expected a formula of the numbers of the group at byte 8",
        ),
        (
            "0i:{f!|n^0;=@0}",
            "expected a formula of the numbers of the group at byte 7",
        ),
        (
            "0i^a>b@0*1:q?{f!|n^12;=@0}",
            "expected a formula of the numbers of the group at byte 17",
        ),
        ("0i^a b>c@0*1:q?", "expected the name of a frame at byte 3"),
        (
            "0i^$0>c@0*1:q?",
            "expected a change of frames whose values are kept at byte 2",
        ),
        (
            "0i^a>c@1*1:q?",
            "expected a change of frames whose values are kept at byte 2",
        ),
        ("0i^a>c@0*1:[q?]", "expected a value at byte 13"),
        ("0i:{f!|=@0", "expected `}` at byte 10"),
        ("0i:{f!|=mm}", "expected a number at byte 8"),
        (&deep, "expected at most 32 levels at byte 36"),
        (&long, "expected at most 65536 bytes at byte 0"),
    ];
    for (text, expected) in cases {
        let error = text.parse::<Plan>().expect_err(text);
        assert_eq!(error.to_string(), expected, "{text}");
    }
}

#[test]
fn random_texts_do_not_panic() {
    let mut random = fastrand::Rng::with_seed(38);
    let letters: Vec<char> = "0123456789iIoOe:,[]()<>{}/p+-fdbBhHqQsxé "
        .chars()
        .collect();
    let words = ["{f!|", "=@0}", "n@0;", "m@0&2e0;", "d!", "$0"];
    let (mut plans, mut groups) = (0, 0);
    for _ in 0..100_000 {
        let mut text = String::from("0i:");
        for _ in 0..random.usize(0..24) {
            if random.u8(..4) == 0 {
                text.push_str(words[random.usize(0..words.len())]);
            } else {
                text.push(letters[random.usize(0..letters.len())]);
            }
        }
        if let Ok(plan) = text.parse::<Plan>() {
            assert_eq!(plan.to_string().parse(), Ok(plan.clone()), "{text}");
            let mut bytes = [7; 64];
            let program = plan.program(0, Place::Input).expect("a program");
            let _ = program.run(&mut bytes, random.usize(0..80));
            plans += 1;
            groups += usize::from(text.contains('!'));
        }
    }
    assert!(plans > 1000 && groups > 10, "{plans} {groups}");
}
