//! Figures of this crate equal those of pint, scipy, transforms3d and pytransform3d.

use crate::rotations::{Sample, samples};
use rc_quantity::rotation::{AxisAngle, EulerOrder, Matrix, Quaternion, Turns, to_rotation_vector};
use rc_quantity::{Spatial, Transform, UNITS};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const PACKAGES: &str = "scipy==1.15.3\ntransforms3d==0.4.2\npint==0.24.4\npytransform3d==3.14.2\n";

fn python(test: &str) -> Option<&'static Path> {
    rc_test_support::python::packages("quantities", PACKAGES, test)
}

/// Runs a part of `oracle.py` on lines, of which it has to check so many.
fn check(python: &Path, part: &str, lines: &str, count: usize) {
    let folder = std::env::temp_dir();
    let list = folder.join(format!("rc-quantity-{part}-{}.csv", std::process::id()));
    std::fs::write(&list, lines).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/oracle.py");
    let output = Command::new(python)
        .args([script, part])
        .arg(&list)
        .output();
    let _ = std::fs::remove_file(&list);
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let checked = String::from_utf8_lossy(&output.stdout);
    assert_eq!(checked.trim(), count.to_string());
}

#[test]
fn all_pairs_of_units_convert_as_in_pint() {
    let Some(python) = python("all_pairs_of_units_convert_as_in_pint") else {
        return;
    };
    let (mut lines, mut count) = (String::new(), 0);
    for from in &UNITS {
        for to in &UNITS {
            if let Some(conversion) = from.unit.conversion_to(&to.unit) {
                let value = conversion.apply(12.5);
                writeln!(lines, "{},{},{value:e}", from.symbol, to.symbol).expect("a text");
                count += 1;
            }
        }
    }
    check(python, "units", &lines, count);
}

fn flat(matrix: &Matrix) -> Vec<f64> {
    matrix.iter().flatten().copied().collect()
}

fn put(lines: &mut String, words: &[&str], numbers: &[f64]) {
    lines.push_str(&words.join(","));
    for number in numbers {
        write!(lines, ",{number:e}").expect("a text");
    }
    lines.push('\n');
}

#[test]
fn all_representations_equal_scipy_and_transforms3d() {
    let Some(python) = python("all_representations_equal_scipy_and_transforms3d") else {
        return;
    };
    let (mut lines, mut count) = (String::new(), 0);
    for order in EulerOrder::all() {
        let name = order.to_string();
        let axes = &name[..3];
        let turns = match order.turns() {
            Turns::Fixed => "s",
            Turns::Moving => "r",
        };
        for Sample { angles, .. } in samples(order) {
            let matrix = order.matrix(angles);
            let quaternion = Quaternion::of_matrix(&matrix);
            let turn = AxisAngle::of_matrix(&matrix);
            let mut numbers = angles.to_vec();
            numbers.extend(flat(&matrix));
            numbers.extend(quaternion.to_xyzw());
            numbers.extend(turn.axis);
            numbers.push(turn.angle);
            numbers.extend(to_rotation_vector(&matrix));
            numbers.extend(order.angles(&matrix).angles);
            put(&mut lines, &[axes, turns], &numbers);
            count += 1;
        }
    }
    check(python, "rotations", &lines, count);
}

#[test]
fn twists_and_wrenches_equal_the_adjoint_of_pytransform3d() {
    let Some(python) = python("twists_and_wrenches_equal_the_adjoint_of_pytransform3d") else {
        return;
    };
    let mut random = fastrand::Rng::with_seed(3);
    let (mut lines, mut count) = (String::new(), 0);
    for Sample { angles, .. } in samples(EulerOrder::RPY).into_iter().take(1000) {
        let mut three = || std::array::from_fn(|_| random.f64() * 4.0 - 2.0);
        let transform = Transform {
            rotation: EulerOrder::RPY.matrix(angles),
            translation: three(),
        };
        let spatial = Spatial {
            angular: three(),
            linear: three(),
        };
        let mut numbers = flat(&transform.rotation);
        numbers.extend(transform.translation);
        for part in [
            spatial,
            transform.twist(&spatial),
            transform.wrench(&spatial),
        ] {
            numbers.extend(part.angular.into_iter().chain(part.linear));
        }
        put(&mut lines, &[], &numbers);
        count += 1;
    }
    // The first column is empty.
    check(python, "motions", &lines, count);
}
