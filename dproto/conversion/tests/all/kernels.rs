//! Formulas that only move and scale numbers run without their interpreter. Behind a text, numbers
//! have no fixed place, and each step of a formula is done: the bits are the same.

use crate::programs::program;
use fastrand::Rng;
use rc_conversion::{Fault, Program};
use std::fmt::Write as _;

/// A random group of numbers.
struct Case {
    /// The group, and one that begins with a text.
    group: String,
    behind: String,
    /// Bytes of an element, and of a number.
    size: usize,
    width: usize,
    is_float: bool,
    /// The first number of a vector whose length is checked.
    norm: Option<usize>,
}

const FACTORS: [&str; 8] = [
    "1e3",
    "1e0",
    "3e0",
    "3.048e-1",
    "1.7453292519943295e-2",
    "2.5e-1",
    "1e30",
    "1e-30",
];

/// What becomes of a number: its formula is appended. The result is the operand.
fn output(
    random: &mut Rng,
    steps: &mut String,
    next: &mut u32,
    from: usize,
    is_f32: bool,
) -> String {
    let mut operand = format!("@{from}");
    let mut step = |operand: &mut String, text: String| {
        let _ = write!(steps, "{text};");
        *operand = format!("${next}");
        *next += 1;
    };
    let factor = |random: &mut Rng| FACTORS[random.usize(..FACTORS.len())];
    let kind = random.u8(..6);
    if matches!(kind, 1 | 3) {
        let text = format!("m{operand}&{}", factor(random));
        step(&mut operand, text);
    }
    if matches!(kind, 2 | 3) {
        let text = format!("d{operand}&{}", factor(random));
        step(&mut operand, text);
    }
    if is_f32 && random.bool() {
        let text = format!("t{operand}");
        step(&mut operand, text);
    }
    if random.u8(..3) == 0 {
        let text = format!("n{operand}");
        step(&mut operand, text);
    }
    operand
}

fn case(random: &mut Rng) -> Case {
    let kinds = [
        ("f", 4),
        ("f", 4),
        ("f", 4),
        ("d", 8),
        ("d", 8),
        ("i", 4),
        ("h", 2),
    ];
    let (letter, width) = kinds[random.usize(..kinds.len())];
    let count = if random.bool() {
        3
    } else {
        random.usize(1..10)
    };
    let (mut steps, mut next) = (String::new(), 0);
    let norm = (count > 3 && letter != "i" && random.bool()).then(|| random.usize(..count - 2));
    if let Some(first) = norm {
        // The length of three numbers.
        let _ = write!(
            steps,
            "m@{0}&@{0};m@{1}&@{1};a$0&$1;m@{2}&@{2};a$2&$3;r$4;",
            first,
            first + 1,
            first + 2
        );
        steps += "q$5&5e-1&1.5e0;";
        next = 7;
    }
    let mut order: Vec<usize> = (0..count).collect();
    random.shuffle(&mut order);
    if random.u8(..8) == 0 {
        order[0] = random.usize(..count);
    }
    let outputs: Vec<String> = (0..count)
        .map(|own| match random.u8(..5) {
            0 => format!("@{own}"),
            _ => output(random, &mut steps, &mut next, order[own], letter == "f"),
        })
        .collect();
    // Other bytes, which stay.
    let (before, after) = (
        [0, 0, 1][random.usize(..3)],
        [0, 0, 1, 2][random.usize(..4)],
    );
    let other = |times: usize| match times {
        0 => String::new(),
        times => format!("{times}{letter}"),
    };
    let items = format!("{}{count}{letter}!{}", other(before), other(after));
    let formula = format!("{steps}={}", outputs.join("&"));
    Case {
        group: format!("{{{items}|{formula}}}"),
        behind: format!("{{s3B{items}|{formula}}}"),
        size: (before + count + after) * width,
        width,
        is_float: matches!(letter, "f" | "d"),
        norm: norm.map(|first| before + first),
    }
}

/// The bytes of an element with numbers that are mostly of an ordinary size.
fn element(random: &mut Rng, case: &Case, rare: u32) -> Vec<u8> {
    const ODD: [f64; 8] = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        -0.0,
        1e38,
        1e308,
        1e-45,
        5e-324,
    ];
    let mut out: Vec<u8> = (0..case.size).map(|_| random.u8(..)).collect();
    if !case.is_float {
        return out;
    }
    for at in 0..case.size / case.width {
        let is_long = case
            .norm
            .is_some_and(|first| (first..first + 3).contains(&at));
        let scale = if is_long {
            1.0
        } else {
            10_f64.powi(random.i32(-4..5))
        };
        let mut number = (random.f64() - 0.5) * 1.9 * scale;
        if is_long {
            number = (0.3 + 0.3 * random.f64()) * if random.bool() { 1.0 } else { -1.0 };
        }
        if random.u32(..1000) < rare {
            number = ODD[random.usize(..ODD.len())];
        }
        let place = at * case.width;
        if case.width == 4 {
            out[place..place + 4].copy_from_slice(&(number as f32).to_le_bytes());
        } else {
            out[place..place + 8].copy_from_slice(&number.to_le_bytes());
        }
    }
    out
}

fn moved(fault: Fault, by: isize) -> Fault {
    let place = |at: usize| at.checked_add_signed(by).expect("a place");
    fault.moved(place(fault.at()))
}

/// An element by the steps of the formula.
fn interpreted(behind: &Program, element: &[u8]) -> (Vec<u8>, Result<(), Fault>) {
    // An empty text with its zero, and 3 bytes.
    let mut bytes = [&[1, 0, 0, 0, 0, 0, 0, 0][..], element].concat();
    let end = behind.run(&mut bytes, 0);
    (
        bytes.split_off(8),
        end.map(drop).map_err(|fault| moved(fault, -8)),
    )
}

#[test]
fn one_group_has_the_bits_of_its_formula() {
    let mut random = Rng::with_seed(40);
    let mut whole = 0;
    for _ in 0..1500 {
        let case = case(&mut random);
        let (own, behind) = (program(&case.group), program(&case.behind));
        for _ in 0..8 {
            let before = element(&mut random, &case, 60);
            let mut bytes = before.clone();
            let result = own.run(&mut bytes, 0).map(drop);
            let (wanted, expected) = interpreted(&behind, &before);
            assert_eq!(result, expected, "{} {before:?}", case.group);
            whole += usize::from(result.is_ok());
            assert!(
                result.is_err() || bytes == wanted,
                "{} {before:?}",
                case.group
            );
        }
    }
    assert!(whole > 5000, "{whole}");
}

#[test]
fn groups_of_a_sequence_have_the_bits_of_their_formula() {
    let mut random = Rng::with_seed(41);
    let (mut whole, mut refused) = (0, 0);
    for round in 0..300 {
        let case = case(&mut random);
        let behind = program(&case.behind);
        let count = [1, 3, 15, 16, 127, 128, 129, 300][round % 8];
        let rare = u32::from(round % 3 == 0);
        let elements: Vec<Vec<u8>> = (0..count)
            .map(|_| element(&mut random, &case, rare))
            .collect();
        let (mut wanted, mut expected) = (Vec::new(), Ok(()));
        let mut rest = elements.iter();
        for own in rest.by_ref() {
            let (bytes, result) = interpreted(&behind, own);
            let shift = isize::try_from(wanted.len()).expect("few bytes");
            wanted.extend(bytes);
            if let Err(fault) = result {
                expected = Err(moved(fault, shift));
                break;
            }
        }
        wanted.extend(rest.flatten());
        let padding = if case.width == 8 { 4 } else { 0 };
        let all = [
            (format!("[{}]", case.group), true),
            (format!("{count}({})", case.group), false),
            (
                format!("{count}<{padding},{}:{}>", case.size, case.group),
                true,
            ),
        ];
        for (items, has_length) in all {
            let mut bytes = Vec::new();
            if has_length {
                bytes.extend(u32::try_from(count).expect("few").to_le_bytes());
                bytes.resize(4 + padding, 0);
            }
            let begin = bytes.len();
            bytes.extend(elements.iter().flatten());
            let result = program(&items).run(&mut bytes, 0).map(drop);
            let shift = isize::try_from(begin).expect("few bytes");
            assert_eq!(
                result,
                expected.map_err(|fault| moved(fault, shift)),
                "{items}"
            );
            match result {
                Ok(()) => {
                    whole += 1;
                    assert_eq!(bytes[begin..], wanted, "{items}");
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(whole > 400 && refused > 50, "{whole} {refused}");
}
