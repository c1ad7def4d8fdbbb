//! Programs on bytes.

use rc_conversion::{Fault, Place, Plan, Program};

pub(crate) fn program(items: &str) -> Program {
    let plan: Plan = format!("0i:{items}").parse().expect("a plan");
    plan.program(0, Place::Input).expect("a program")
}

/// Bytes of a message, aligned as CDR has them.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn put<const N: usize>(mut self, number: [u8; N]) -> Self {
        while !self.0.len().is_multiple_of(N) {
            self.0.push(0);
        }
        self.0.extend(number);
        self
    }

    fn u32(self, number: u32) -> Self {
        self.put(number.to_le_bytes())
    }

    fn f32(self, number: f32) -> Self {
        self.put(number.to_le_bytes())
    }

    fn f64(self, number: f64) -> Self {
        self.put(number.to_le_bytes())
    }

    fn text(self, text: &str) -> Self {
        let mut message = self.u32(u32::try_from(text.len()).expect("a length") + 1);
        message.0.extend(text.bytes());
        message.0.push(0);
        message
    }
}

#[track_caller]
fn converts(items: &str, before: Message, after: &Message) {
    let mut bytes = before.0;
    let end = program(items).run(&mut bytes, 0);
    assert_eq!(bytes, after.0);
    assert_eq!(end, Ok(after.0.len()));
}

#[test]
fn numbers_are_found_behind_texts_and_sequences() {
    let message = |length: f64, single: f32| {
        let begin = Message::default().text("base").f64(length);
        let pairs = begin.u32(2).f32(single).text("a").f32(single).text("bcd");
        // An empty sequence of doubles has no alignment.
        pairs.u32(0).u32(1).f32(single)
    };
    converts(
        "sd{1/1000}[f{1/1000}s][d][f{1/1000}]",
        message(1500.0, 250.0),
        &message(1.5, 0.25),
    );
}

#[test]
fn an_array_of_structures_is_a_loop() {
    let message = |x: f32| {
        let mut message = Message::default();
        for _ in 0..3 {
            message = message.put([7_u8]).f32(x);
        }
        message
    };
    converts("3(Bf{1000})", message(1.5), &message(1500.0));
}

#[test]
fn unused_elements_of_an_image_keep_their_bytes() {
    let message = |used: f64| {
        let begin = Message::default().u32(2).f64(used).u32(9).put([0; 4]);
        begin
            .f64(used)
            .u32(9)
            .put([0; 4])
            .f64(5e307)
            .u32(9)
            .put([0; 4])
    };
    converts("3<4,16:d{1000}8x>", message(0.5), &message(500.0));
    // A length above the bound counts as the bound.
    let full = |value: f32| Message::default().u32(9).f32(value).f32(value);
    converts("2<0,4:f{2}>", full(1.0), &full(2.0));
}

#[test]
fn integers_are_rounded_and_never_wrap() {
    let mut bytes = 1499_i32.to_le_bytes();
    assert_eq!(program("i{1/1000}").run(&mut bytes, 0), Ok(4));
    assert_eq!(i32::from_le_bytes(bytes), 1);
    let mut bytes = [200_u8, 100];
    let expected = Err(Fault::Overflow(0));
    assert_eq!(program("2B{2}").run(&mut bytes, 0), expected);
    let mut bytes = (-3_i16).to_le_bytes();
    assert_eq!(program("h{1000}").run(&mut bytes, 0), Ok(2));
    assert_eq!(i16::from_le_bytes(bytes), -3000);
    let mut bytes = 40_i16.to_le_bytes();
    assert_eq!(program("h{1000}").run(&mut bytes, 0), expected);
    let mut bytes = 0_u64.to_le_bytes();
    assert_eq!(
        program("Q{1-300}").run(&mut bytes, 0),
        expected,
        "no negative number"
    );
}

#[test]
fn nan_and_infinite_numbers_stay() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut bytes = value.to_le_bytes();
        assert_eq!(program("f{1000}").run(&mut bytes, 0), Ok(4));
        let after = f32::from_le_bytes(bytes);
        assert_eq!(
            (after.is_nan(), after.is_sign_negative()),
            (value.is_nan(), value < 0.0)
        );
        assert_eq!(after.is_infinite(), value.is_infinite());
    }
    let mut bytes = [1e38_f32, 1.0].map(f32::to_le_bytes).concat();
    assert_eq!(
        program("2f{1000}").run(&mut bytes, 0),
        Err(Fault::Overflow(0))
    );
}

#[test]
fn a_short_message_is_refused() {
    let whole = Message::default()
        .text("abc")
        .f64(1.0)
        .u32(2)
        .f32(1.0)
        .f32(2.0)
        .0;
    let program = program("sd{2}[f{2}]");
    for length in 0..whole.len() {
        let mut bytes = whole[..length].to_vec();
        let refused = program.run(&mut bytes, 0);
        assert!(
            matches!(refused, Err(Fault::Truncated(_))),
            "{length}: {refused:?}"
        );
    }
    let mut hostile = u32::MAX.to_le_bytes().to_vec();
    hostile.extend([0; 64]);
    assert!(program.run(&mut hostile, 0).is_err());
}

/// The bulk loop and the step-by-step loop give the same bits.
#[test]
fn packed_and_mixed_sequences_give_the_same_bits() {
    let mut random = fastrand::Rng::with_seed(7);
    for code in ["1/1000", "1/180p1", "180/1p-1", "9/5-45967/100", "127/5000"] {
        let numbers: Vec<f64> = (0..100).map(|_| random.f64() * 2e3 - 1e3).collect();
        let conversion = rc_quantity::Conversion::from_code(code).expect("a conversion");
        let mut packed = Message::default().u32(100);
        let mut mixed = Message::default().u32(100);
        for number in &numbers {
            packed = packed.f64(*number);
            mixed = mixed.f64(*number).u32(1);
        }
        let (mut packed, mut mixed) = (packed.0, mixed.0);
        assert!(
            program(&format!("[d{{{code}}}]"))
                .run(&mut packed, 0)
                .is_ok()
        );
        assert!(
            program(&format!("[d{{{code}}}I]"))
                .run(&mut mixed, 0)
                .is_ok()
        );
        for (at, number) in numbers.iter().enumerate() {
            let expected = conversion.apply(*number).to_le_bytes();
            assert_eq!(packed[8 + 8 * at..][..8], expected);
            assert_eq!(mixed[8 + 16 * at..][..8], expected);
        }
    }
}

/// Elements of one layout are converted at once. They have the same bits as values that are listed
/// one by one, from every alignment.
#[test]
fn records_give_the_same_bits_as_single_steps() {
    let mut random = fastrand::Rng::with_seed(11);
    let kinds = [
        "f{1/1000}",
        "d{180p-1}",
        "I",
        "B",
        "Q",
        "h{2}",
        "3f{1000}",
        "2B",
        "7x",
    ];
    let mut converted = 0;
    for _ in 0..3000 {
        let items: String = (0..random.usize(2..6))
            .map(|_| kinds[random.usize(0..kinds.len())])
            .collect();
        let before = ["", "B", "I", "3B", "Q"][random.usize(0..5)];
        let count = random.u32(1..5);
        let case = format!("{before}{count}({items})");
        let one_by_one = format!("{before}{}", items.repeat(count as usize));
        let mut bytes: Vec<u8> = (0..600).map(|_| random.u8(0..64)).collect();
        let mut others = bytes.clone();
        let end = program(&case).run(&mut bytes, 0);
        assert_eq!(
            end.is_ok(),
            program(&one_by_one).run(&mut others, 0).is_ok(),
            "{case}"
        );
        if end.is_ok() {
            assert_eq!(bytes, others, "{case}");
            converted += 1;
        }
    }
    assert!(converted > 1000, "{converted}");
}

/// Elements of one layout are converted a block at a time, with the bits, the faults and the order
/// of single ones.
#[test]
fn groups_in_a_sequence_give_the_same_bits_as_single_ones() {
    let groups = [
        // In other units and axes.
        "{3f!i|d@1&1e3;t$0;n@0;d$2&1e3;t$3;d@2&1e3;t$5;=$1&$4&$6}",
        // Some numbers are refused, or do not fit.
        "{3f!i|m@0&1e37;q@1&-9e1&9e1;=$0&@2&@1}",
        "{3f!i!|i@0;q$0&-1e2&2e9;S@1;L@0&@2;=$2&@1&$3&$1}",
    ];
    let mut random = fastrand::Rng::with_seed(38);
    let (mut refused, mut whole) = (0, 0);
    for group in groups {
        let (all, one) = (program(&format!("[{group}]")), program(group));
        let image = program(&format!("200<0,16:{group}>"));
        for round in 0..60 {
            let count = [1, 2, 63, 64, 65, 200][round % 6];
            let mut message = Message::default().u32(count);
            for _ in 0..count {
                let rare = random.u32(..900);
                let special = [f32::NAN, f32::INFINITY, 95.0, -0.0];
                let special = special.get(rare as usize).copied();
                for at in 0..3 {
                    let number = (random.f32() - 0.5) * 60.0;
                    message = message.f32(special.filter(|_| at == 1).unwrap_or(number));
                }
                message = message.u32(random.u32(..));
            }
            let (mut found, mut wanted) = (message.0.clone(), message.0);
            let mut in_place = found.clone();
            in_place.resize(4 + 200 * 16, 7);
            let mut fault = None;
            for (at, element) in wanted[4..].chunks_exact_mut(16).enumerate() {
                if let Err(error) = one.run(element, 0) {
                    fault = Some(error.moved(4 + 16 * at + error.at()));
                    break;
                }
            }
            let end = all.run(&mut found, 0);
            if let Some(fault) = fault {
                refused += 1;
                assert_eq!(end, Err(fault), "{group}");
            } else {
                whole += 1;
                assert_eq!(end, Ok(found.len()), "{group}");
            }
            assert_eq!(found, wanted, "{group}");
            let end = end.map(|_| in_place.len());
            assert_eq!(image.run(&mut in_place, 0), end, "{group}");
            let (own, rest) = in_place.split_at(found.len());
            assert_eq!(own, found, "{group}");
            assert!(rest.iter().all(|byte| *byte == 7));
        }
    }
    assert!(refused > 10 && whole > 10, "{refused} {whole}");
}

/// A time in seconds and nanoseconds, a frame, then points in float32 that a transform moves.
const MOVED: &str = "0i^$0>map@0*1000000000+1*1:i?I?s?[{2f!|m@0&^0;m@1&^1;a$0&$1;a$2&^3;=$3&@1}]";

fn moved(points: &[[f32; 2]]) -> Message {
    moved_from("lidar", points)
}

fn moved_from(frame: &str, points: &[[f32; 2]]) -> Message {
    let begin = Message::default().put((-2_i32).to_le_bytes()).u32(5);
    let count = u32::try_from(points.len()).expect("a length");
    let message = begin.text(frame).u32(count);
    let points = points.iter().flatten();
    points.fold(message, |message, number| message.f32(*number))
}

#[test]
fn points_move_by_the_transform_of_their_message() {
    let plan: Plan = MOVED.parse().expect("a plan");
    let program = plan.program(0, Place::Input).expect("a program");
    assert!(program.takes_transforms());
    let mut transform = [0.0; 12];
    (transform[0], transform[1], transform[3]) = (2.0, -1.0, 10.0);
    // Both by single steps and in blocks.
    for count in [1, 15, 200] {
        let points = vec![[3.0, 4.0]; count];
        let mut bytes = moved(&points).0;
        let needed = program.needed(&mut bytes, 0).expect("a message");
        assert_eq!(bytes, moved(&points).0, "looking changes nothing");
        assert_eq!(needed.len(), 1);
        assert_eq!((needed[0].from.as_str(), needed[0].to), ("lidar", "map"));
        assert_eq!(needed[0].time, -1_999_999_995);
        let ran = program.run_with(&mut bytes, 0, &[transform]);
        assert_eq!(ran.map(|ran| ran.end), Ok(bytes.len()));
        assert_eq!(bytes, moved(&vec![[12.0, 4.0]; count]).0);
    }
}

/// Each message says in which frame its values are, so that the name may change at any time.
#[test]
fn the_name_of_a_frame_may_change_with_each_message() {
    let plan: Plan = MOVED.parse().expect("a plan");
    let program = plan.program(0, Place::Input).expect("a program");
    for name in ["lidar", "lidar_front", "x", "lidar"] {
        let mut bytes = moved_from(name, &[[3.0, 4.0]]).0;
        let needed = program.needed(&mut bytes, 0).expect("a message");
        assert_eq!((needed[0].from.as_str(), needed[0].to), (name, "map"));
        let mut transform = [0.0; 12];
        (transform[0], transform[1], transform[3]) = (2.0, -1.0, 10.0);
        let ran = program.run_with(&mut bytes, 0, &[transform]);
        assert_eq!(ran.map(|ran| ran.end), Ok(bytes.len()));
        assert_eq!(bytes, moved_from(name, &[[12.0, 4.0]]).0);
    }
}

/// The time of a change of frames is converted, too: the change reads it before.
#[test]
fn a_time_is_read_before_it_is_converted() {
    let text = "0i^lidar>map@0*1000000:q?{1000}2f{f!|a@0&^3;=$0}";
    let plan: Plan = text.parse().expect("a plan");
    assert_eq!(plan.to_string(), text);
    let program = plan.program(0, Place::Input).expect("a program");
    let message = |time: i64, x: f32| {
        let begin = Message::default().put(time.to_le_bytes());
        begin.f32(1.0).f32(2.0).f32(x)
    };
    let mut bytes = message(7, 3.0).0;
    let needed = program.needed(&mut bytes, 0).expect("a message");
    assert_eq!(needed[0].time, 7_000_000);
    let mut transform = [0.0; 12];
    transform[3] = 10.0;
    let ran = program.run_with(&mut bytes, 0, &[transform]);
    assert_eq!(ran.map(|ran| ran.end), Ok(bytes.len()));
    assert_eq!(bytes, message(7000, 13.0).0);
}

/// A group behind a number is no conversion of this number, also if it begins with a conversion.
#[test]
fn a_group_behind_a_number_may_have_conversions() {
    for number in ["i", "i{3}"] {
        let text = format!("0i:{number}{{f{{1000}}f!|a@0&1e0;=$0}}");
        let plan: Plan = text.parse().expect("a plan");
        assert_eq!(plan.to_string(), text);
        let program = plan.program(0, Place::Input).expect("a program");
        let begin = Message::default().put(2_i32.to_le_bytes());
        let mut bytes = begin.f32(0.5).f32(7.0).0;
        assert_eq!(program.run(&mut bytes, 0), Ok(12));
        let first = if number == "i" { 2_i32 } else { 6 };
        let begin = Message::default().put(first.to_le_bytes());
        assert_eq!(bytes, begin.f32(500.0).f32(8.0).0);
    }
}

/// The program of a message tells a lock of any of its elements, by single steps and in blocks.
#[test]
fn a_gimbal_lock_is_told() {
    let plan: Plan = "0i:[{2d!|L@0&@1;=$0&@1%$0}]".parse().expect("a plan");
    let program = plan.program(0, Place::Input).expect("a program");
    for count in [1, 15, 200] {
        for locked in [None, Some(0), Some(count - 1)] {
            let mut message = Message::default()
                .u32(u32::try_from(count).expect("few"))
                .u32(0);
            for at in 0..count {
                let size = if Some(at) == locked { 1e-15_f64 } else { 0.5 };
                message = message.put(size.to_le_bytes()).put(0_f64.to_le_bytes());
            }
            let ran = program.run_with(&mut message.0, 0, &[]).expect("a message");
            assert_eq!(ran.is_locked, locked.is_some(), "{count} {locked:?}");
        }
    }
}

#[test]
fn a_message_without_what_a_transform_needs_is_refused() {
    let plan: Plan = MOVED.parse().expect("a plan");
    let program = plan.program(0, Place::Input).expect("a program");
    let whole = moved(&[[3.0, 4.0]]).0;
    // A program that takes transforms does nothing without them.
    assert_eq!(program.run(&mut whole.clone(), 0), Err(Fault::Value(0)));
    for end in 0..17 {
        let mut cut = whole[..end].to_vec();
        assert!(
            matches!(program.needed(&mut cut, 0), Err(Fault::Truncated(_))),
            "{end}"
        );
    }
    let mut strange = whole;
    strange[12] = 0xff;
    assert_eq!(program.needed(&mut strange, 0), Err(Fault::Value(12)));
    let plan: Plan = "0i^a>b@0*1000000000:d?{d!|a@0&^3;=$0}"
        .parse()
        .expect("a plan");
    let program = plan.program(0, Place::Input).expect("a program");
    let time = |seconds: f64| {
        let mut bytes = Message::default().f64(seconds).f64(1.0).0;
        let needed = program.needed(&mut bytes, 0);
        needed.map(|needed| needed[0].time)
    };
    assert_eq!(time(1.5), Ok(1_500_000_000));
    assert_eq!(time(f64::NAN), Err(Fault::Value(0)));
    assert_eq!(time(1e300), Err(Fault::Value(0)));
}

/// Formulas that only move and scale numbers have a program of their own. Behind a text, the numbers
/// have no fixed place, and each step of the formula is done.
#[test]
fn moved_and_scaled_numbers_have_the_bits_of_their_formulas() {
    let points = "3f!|d@1&1e3;t$0;n@0;d$2&1e3;t$3;m@2&3e0;d$5&7e0;t$6;=$1&$4&$7";
    let turned = "3f!|n@0;d@1&1e3;t$1;m@2&2e0;=$3&$0&$2";
    let doubles = "d!f!d!|m@2&3.048e-1;n@1;=$0&$1&@0";
    let pose = "3f!4f!|m@3&@3;m@4&@4;a$0&$1;m@5&@5;a$2&$3;m@6&@6;a$4&$5;r$6;q$7&9.99e-1&1.001e0;\
                d@1&1e3;t$9;n@0;d$11&1e3;t$12;n@3;=$10&$13&@2&@4&$14&@5&@6";
    let odd = [
        f32::NAN,
        f32::INFINITY,
        -0.0,
        0.0,
        f32::MAX,
        f32::MIN_POSITIVE,
        1e-45,
    ];
    for group in [points, turned, doubles, pose] {
        let (items, _) = group.split_once('|').expect("a formula");
        let (singles, size) = match items {
            "3f!" => (3, 12),
            "3f!4f!" => (7, 28),
            _ => (6, 24),
        };
        let [alone, behind] = [format!("{{{group}}}"), format!("{{s{group}}}")];
        let many = format!("[{alone}]");
        for _ in 0..400 {
            let mut numbers: Vec<f32> = (0..singles)
                .map(|_| (fastrand::f32() - 0.5) * 10_f32.powi(fastrand::i32(-3..4)))
                .collect();
            if group == pose && fastrand::u8(..) < 200 {
                let length = numbers[3..].iter().map(|n| n * n).sum::<f32>().sqrt();
                numbers[3..].iter_mut().for_each(|number| *number /= length);
            }
            if fastrand::u8(..) < 60 {
                let place = fastrand::usize(..numbers.len());
                numbers[place] = odd[fastrand::usize(..odd.len())];
            }
            let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            let mut own = bytes.clone();
            let result = program(&alone).run(&mut own, 0).map(drop);
            // An empty text, whose zero and padding fill 8 bytes.
            let mut other = [&[1, 0, 0, 0, 0, 0, 0, 0][..], &bytes].concat();
            let expected = program(&behind).run(&mut other, 0).map(drop);
            let moved = |fault: Fault| fault.moved(fault.at() - 8);
            assert_eq!(result, expected.map_err(moved), "{group} {numbers:?}");
            if result.is_ok() {
                assert_eq!(own, other[8..], "{group} {numbers:?}");
            }
            // The value among many others, in a block.
            let count = 40_u32;
            let begin = |length: u32| length.to_le_bytes().to_vec();
            let pad = if size == 24 && items.starts_with('d') {
                4
            } else {
                0
            };
            let mut all = begin(count);
            all.resize(4 + pad, 0);
            all.extend(bytes.repeat(count as usize));
            let result = program(&many).run(&mut all, 0).map(drop);
            assert_eq!(result.is_ok(), expected.is_ok());
            if result.is_ok() {
                assert!(all[4 + pad..].chunks(size).all(|element| *element == own));
            }
        }
    }
}
