//! Printed functions, compiled and run, beside the computed plans and beside scipy.

use crate::samples::{self, samples};
use crate::{library, python};
use rc_conversion::{Formula, Item};
use rc_plans::{Network, Plan, Program, c, rust};
use rc_prototypes::model::Prototype;
use rc_quantity::rotation::{EulerOrder, Quaternion};
use rc_vocabulary::Primitive;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A plan with the numbers that it converts.
struct Case {
    plan: Plan,
    /// From the last prototype to the one with which results are compared where the last bits differ
    /// between mathematical libraries. Near a singularity, other numbers may mean the same.
    back: Program,
    samples: Vec<Vec<f64>>,
}

/// All pairs of prototypes of all meanings. Of the Euler orders, those that follow each other.
fn cases() -> Vec<Case> {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let mut cases = Vec::new();
    for (at, from) in library.prototypes.iter().enumerate() {
        for (other, to) in library.prototypes.iter().enumerate() {
            let both = from.name.starts_with("euler_") && to.name.starts_with("euler_");
            if from.semantic != to.semantic || at == other || both && other != at + 1 {
                continue;
            }
            let canonical = match to.semantic.as_str() {
                "Orientation" => "matrix",
                "Pose" => "columns",
                other => samples::source(other),
            };
            let back = network.plan(&to.name, canonical).expect("a plan");
            cases.push(Case {
                plan: network.plan(&from.name, &to.name).expect("a plan"),
                back: back.program,
                samples: samples(&network, &library, &from.name)
                    .into_iter()
                    .step_by(2)
                    .collect(),
            });
        }
    }
    assert!(cases.len() > 500, "{}", cases.len());
    cases
}

/// The inputs of all cases: the number of the case, then the bits of its values.
fn inputs(cases: &[Case]) -> String {
    let mut out = String::new();
    for (at, case) in cases.iter().enumerate() {
        for sample in &case.samples {
            write!(out, "{at}").expect("a text");
            for value in sample {
                write!(out, " {:x}", value.to_bits()).expect("a text");
            }
            out.push('\n');
        }
    }
    out
}

/// Compares what a program printed with the computed plans: bit for bit, or to 1e-12 where
/// mathematical functions differ. Gives the number of lines.
fn compare(cases: &[Case], printed: &str, language: &str) -> usize {
    let mut lines = printed.lines();
    let mut count = 0;
    for case in cases {
        for sample in &case.samples {
            let line = lines.next().unwrap_or_default();
            let what = format!("{language}: {} {sample:?}: {line}", case.plan);
            let numbers = line
                .split_whitespace()
                .map(|word| u64::from_str_radix(word, 16));
            let numbers: Vec<f64> = numbers
                .map(|bits| f64::from_bits(bits.expect("bits")))
                .collect();
            let Ok(expected) = case.plan.program.run(sample) else {
                assert_eq!(line, "refused", "{what}");
                continue;
            };
            assert_eq!(numbers.len(), expected.len(), "{what}");
            count += 1;
            if !case.plan.program.is_transcendental() {
                for (own, other) in numbers.iter().zip(&expected) {
                    assert!(
                        own.to_bits() == other.to_bits(),
                        "{what}\nexpected {expected:?}"
                    );
                }
                continue;
            }
            let own = case.back.run(&numbers).expect(&what);
            let other = case.back.run(&expected).expect(&what);
            for (own, other) in own.iter().zip(&other) {
                let limit = 1e-12 * other.abs().max(1.0);
                assert!(
                    (own - other).abs() <= limit,
                    "{what}\nexpected {expected:?}"
                );
            }
        }
    }
    assert_eq!(lines.next(), None, "{language}");
    count
}

/// Runs a program on a file with the inputs, and gives what it prints.
fn run(command: &mut Command, inputs: &Path) -> String {
    let output = command.arg(inputs).output().expect("it starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {errors}");
    String::from_utf8(output.stdout).expect("a text")
}

/// Compiles one file.
pub(crate) fn compile(command: &mut Command, folder: &Path) -> PathBuf {
    let program = folder.join("program");
    let output = command
        .arg("-o")
        .arg(&program)
        .output()
        .expect("a compiler");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    program
}

/// The functions, and for each case what `call` prints.
fn whole(
    cases: &[Case],
    print: impl Fn(&Plan) -> String,
    call: impl Fn(usize, &Case) -> String,
) -> (String, String) {
    let (mut functions, mut calls) = (String::new(), String::new());
    for (at, case) in cases.iter().enumerate() {
        functions += &print(&case.plan);
        functions.push('\n');
        calls += &call(at, case);
    }
    (functions, calls)
}

fn name(case: &Case) -> String {
    format!("{}_to_{}", case.plan.from, case.plan.to())
}

pub(crate) fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

/// The program of a message with these numbers.
fn message((width, number): (usize, Primitive), formula: Formula) -> rc_conversion::Program {
    let marks = u32::try_from(width).expect("few");
    rc_conversion::Program::new(&[Item::Group {
        items: vec![Item::Marked(marks, number)],
        formula,
    }])
}

/// The program that a connection runs over the bytes of a message computes the bits of the plan, and
/// refuses what it refuses.
#[test]
fn programs_of_messages_give_the_numbers_of_the_plan() {
    let (mut count, mut refused) = (0, 0);
    for case in cases() {
        let program = &case.plan.program;
        let (inputs, outputs) = (program.inputs(), program.outputs());
        let width = inputs.max(outputs);
        let places = |count: usize| (0..).map(Some).take(count).collect::<Vec<Option<u32>>>();
        let formula = case
            .plan
            .formula((&places(inputs), &places(outputs)), width, 0);
        let of_message = message((width, Primitive::F64), formula);
        for sample in &case.samples {
            let mut numbers = sample.clone();
            numbers.resize(width, 0.0);
            let mut bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            let ran = of_message.run(&mut bytes, 0);
            let Ok(expected) = program.run(sample) else {
                assert!(ran.is_err(), "{} {sample:?}", case.plan);
                refused += 1;
                continue;
            };
            assert_eq!(ran, Ok(bytes.len()), "{} {sample:?}", case.plan);
            let (found, _) = bytes.as_chunks::<8>();
            for (own, other) in found.iter().zip(&expected) {
                let bits = u64::from_le_bytes(*own);
                assert_eq!(bits, other.to_bits(), "{} {sample:?}", case.plan);
            }
            count += 1;
        }
    }
    assert!(count > 15_000, "{count} and {refused} refused");
}

/// Rotations in messages of `float32` are those of `float64`, for the same input, but for the last bits.
#[test]
fn single_precision_is_within_4_units_in_the_last_place() {
    let text = samples::text();
    let (doubles, singles) = (library(&text), library(&text.replace("double[", "float[")));
    let (wide, narrow) = (Network::new(&doubles), Network::new(&singles));
    let is_turn = |of: &&Prototype| of.semantic == "Orientation";
    let names: Vec<&str> = doubles
        .prototypes
        .iter()
        .filter(is_turn)
        .map(|of| of.name.as_str())
        .collect();
    let mut count = 0;
    for (at, from) in names.iter().enumerate() {
        // All as the next one, and as quaternions, matrices, and axes with angles.
        let next = names[(at + 1) % names.len()];
        for to in [next, samples::TURN, "matrix", "axis"] {
            if from == &to {
                continue;
            }
            let exact = wide.plan(from, to).expect("a plan").program;
            let plan = narrow.plan(from, to).expect("a plan");
            let (inputs, outputs) = (exact.inputs(), exact.outputs());
            let width = inputs.max(outputs);
            let places = |count: usize| (0..).map(Some).take(count).collect::<Vec<Option<u32>>>();
            let formula = plan.formula((&places(inputs), &places(outputs)), width, 0);
            let of_message = message((width, Primitive::F32), formula);
            for sample in samples(&wide, &doubles, from).iter().step_by(3) {
                let mut numbers: Vec<f32> = sample.iter().map(|number| *number as f32).collect();
                let same: Vec<f64> = numbers.iter().map(|number| f64::from(*number)).collect();
                let Ok(expected) = exact.run(&same) else {
                    continue;
                };
                numbers.resize(width, 0.0);
                let mut bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
                assert_eq!(
                    of_message.run(&mut bytes, 0),
                    Ok(bytes.len()),
                    "{plan} {sample:?}"
                );
                let (found, _) = bytes.as_chunks::<4>();
                for (own, other) in found.iter().zip(&expected) {
                    let own = f32::from_le_bytes(*own);
                    let near = *other as f32;
                    let unit = f64::from(f32::from_bits(near.abs().to_bits() + 1) - near.abs());
                    let error = (f64::from(own) - other).abs();
                    assert!(error <= 4.0 * unit, "{own} {other} {plan} {sample:?}");
                }
                count += 1;
            }
        }
    }
    assert!(count > 2_000, "{count}");
}

/// Angles of which only the sum is known are counted, and no others.
#[test]
fn a_gimbal_lock_is_told() {
    let library = library(&samples::text());
    let network = Network::new(&library);
    let mut told = 0;
    for order in EulerOrder::all() {
        let name = samples::euler(order);
        let plan = network.plan(samples::TURN, &name).expect("a plan");
        let places: Vec<Option<u32>> = (0..4).map(Some).collect();
        let of_message = message(
            (4, Primitive::F64),
            plan.formula((&places, &places[..3]), 4, 0),
        );
        for turn in samples::turns() {
            let mut bytes: Vec<u8> = turn.iter().flat_map(|n| n.to_le_bytes()).collect();
            let ran = of_message.run_with(&mut bytes, 0, &[]).expect("a turn");
            let expected = order.angles(&Quaternion::xyzw(turn).matrix()).is_locked;
            assert_eq!(ran.is_locked, expected, "{name} {turn:?}");
            told += usize::from(expected);
        }
    }
    assert!(told > 20, "{told}");
}

#[test]
fn functions_in_rust_give_the_numbers_of_the_plan() {
    let (cases, folder) = (cases(), tempfile::tempdir().expect("a folder"));
    let folder = folder.path();
    let (functions, calls) = whole(&cases, rust, |at, case| {
        let count = case.plan.program.inputs();
        format!(
            "            {at} => {}(&<[f64; {count}]>::try_from(values).unwrap()).map(Vec::from),\n",
            name(case)
        )
    });
    let text = format!(
        "{functions}
fn main() {{
    let path = std::env::args().nth(1).unwrap();
    for line in std::fs::read_to_string(path).unwrap().lines() {{
        let mut words = line.split(' ');
        let case: usize = words.next().unwrap().parse().unwrap();
        let values: Vec<f64> = words.map(|word| f64::from_bits(u64::from_str_radix(word, 16).unwrap())).collect();
        let result = match case {{
{calls}            _ => unreachable!(),
        }};
        match result {{
            None => println!(\"refused\"),
            Some(values) => {{
                let words: Vec<String> = values.iter().map(|value| format!(\"{{:x}}\", value.to_bits())).collect();
                println!(\"{{}}\", words.join(\" \"));
            }}
        }}
    }}
}}
"
    );
    let source = written(folder, "program.rs", &text);
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let mut command = Command::new(rustc);
    command
        .args(["--edition", "2024", "-D", "warnings"])
        .arg(&source);
    let program = compile(&mut command, folder);
    let list = written(folder, "inputs", &inputs(&cases));
    let printed = run(&mut Command::new(program), &list);
    assert!(compare(&cases, &printed, "Rust") > 15_000);
}

#[test]
fn functions_in_c_give_the_numbers_of_the_plan() {
    let (cases, folder) = (cases(), tempfile::tempdir().expect("a folder"));
    let folder = folder.path();
    let (functions, calls) = whole(&cases, c, |at, case| {
        format!(
            "        case {at}: count = {}; inputs = {}; break;\n",
            case.plan.program.outputs(),
            case.plan.program.inputs()
        )
    });
    let (_, dispatch) = whole(
        &cases,
        |_| String::new(),
        |at, case| {
            format!(
                "        case {at}: refused = {}(from, to); break;\n",
                name(case)
            )
        },
    );
    let text = format!(
        "#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <inttypes.h>
{functions}
int main(int argc, char **argv)
{{
    FILE *file = fopen(argv[argc - 1], \"r\");
    int number;
    while (file && fscanf(file, \"%d\", &number) == 1) {{
        double from[16], to[16];
        int count = 0, inputs = 0, refused = 1;
        switch (number) {{
{calls}        }}
        for (int at = 0; at < inputs; at++) {{
            uint64_t bits;
            if (fscanf(file, \"%\" SCNx64, &bits) != 1) return 2;
            memcpy(&from[at], &bits, sizeof bits);
        }}
        switch (number) {{
{dispatch}        }}
        if (refused) {{
            printf(\"refused\\n\");
            continue;
        }}
        for (int at = 0; at < count; at++) {{
            uint64_t bits;
            memcpy(&bits, &to[at], sizeof bits);
            printf(\"%\" PRIx64 \" \", bits);
        }}
        printf(\"\\n\");
    }}
    return 0;
}}
"
    );
    let source = written(folder, "program.c", &text);
    let mut command = Command::new("cc");
    let flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-ffp-contract=off",
    ];
    command.args(flags).arg(&source).arg("-lm");
    let program = compile(&mut command, folder);
    let list = written(folder, "inputs", &inputs(&cases));
    let printed = run(&mut Command::new(program), &list);
    assert!(compare(&cases, &printed, "C") > 15_000);
}

#[test]
fn functions_in_python_give_the_numbers_of_the_plan() {
    let (cases, folder) = (cases(), tempfile::tempdir().expect("a folder"));
    let folder = folder.path();
    let (functions, calls) = whole(&cases, rc_plans::python, |_, case| {
        format!("{}, ", name(case))
    });
    let text = format!(
        "{functions}
import struct
import sys

cases = [{calls}]
for line in open(sys.argv[1]):
    number, *words = line.split()
    values = [struct.unpack(\"<d\", struct.pack(\"<Q\", int(word, 16)))[0] for word in words]
    try:
        values = cases[int(number)](values)
        print(*(\"%x\" % struct.unpack(\"<Q\", struct.pack(\"<d\", value)) for value in values))
    except ValueError:
        print(\"refused\")
"
    );
    let source = written(folder, "program.py", &text);
    let list = written(folder, "inputs", &inputs(&cases));
    let printed = run(Command::new("python3").arg(source), &list);
    assert!(compare(&cases, &printed, "Python") > 15_000);
}

/// All representations of rotations mean what scipy says, to 1e-12.
#[test]
fn rotations_are_those_of_scipy() {
    let Some(python) = python("rotations_are_those_of_scipy") else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/rotations.py");
    let library = library(&samples::text());
    let network = Network::new(&library);
    let (mut lines, mut count) = (String::new(), 0);
    for of in library
        .prototypes
        .iter()
        .filter(|of| of.semantic == "Orientation")
    {
        let rc_prototypes::model::Content::Values { coordinate, .. } = &of.content else {
            continue;
        };
        // Those with the axes and units of the samples.
        if of.name == "mirrored" || of.name == "real_first" || of.name == "rpy_degrees" {
            continue;
        }
        let program = |from: &str, to: &str| network.plan(from, to).expect("a plan").program;
        let (there, back) = (
            program(samples::TURN, &of.name),
            program(&of.name, samples::TURN),
        );
        for turn in samples::turns() {
            let numbers = there.run(&turn).expect("in range");
            let again = back.run(&numbers).expect("in range");
            for (coordinate, numbers) in [(coordinate.as_str(), &numbers), ("quaternion", &again)] {
                let words = turn
                    .iter()
                    .chain(numbers)
                    .map(|number| format!("{number:e}"));
                let words: Vec<String> = words.collect();
                writeln!(lines, "{coordinate},{}", words.join(",")).expect("a text");
                count += 1;
            }
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    let list = written(folder.path(), "rotations.csv", &lines);
    let printed = run(Command::new(python).arg(script), &list);
    assert_eq!(printed.trim(), count.to_string());
}
