//! Representations of rotations convert into each other.

use rc_quantity::rotation::{
    AxisAngle, EulerOrder, Matrix, NoRotation, Quaternion, from_rotation_vector, to_rotation_vector,
};
use std::f64::consts::{FRAC_PI_2, PI};

/// Angles of an order, and whether the middle one is near a singularity.
pub(crate) struct Sample {
    pub(crate) angles: [f64; 3],
    pub(crate) is_singular: bool,
}

/// 1,000 random angles, and 200 near each singularity of the order.
pub(crate) fn samples(order: EulerOrder) -> Vec<Sample> {
    let mut random = fastrand::Rng::with_seed(24);
    let name = order.to_string();
    let is_proper = name.as_bytes()[0] == name.as_bytes()[2];
    let mut angle = move || (random.f64() * 2.0 - 1.0) * PI;
    let mut all = Vec::new();
    for _ in 0..1000 {
        all.push(Sample {
            angles: [angle(), angle(), angle()],
            is_singular: false,
        });
    }
    let singular = if is_proper {
        [0.0, PI]
    } else {
        [FRAC_PI_2, -FRAC_PI_2]
    };
    for middle in singular {
        for number in 0..200 {
            // From 1 to 1e-16, and 0.
            let distance = if number == 0 {
                0.0
            } else {
                10_f64.powf(-f64::from(number) / 12.5)
            };
            let side = if number % 2 == 0 { distance } else { -distance };
            all.push(Sample {
                angles: [angle(), middle + side, angle()],
                is_singular: distance < 1e-3,
            });
        }
    }
    all
}

#[track_caller]
fn near(one: &Matrix, other: &Matrix, what: &str) {
    for (a, b) in one.iter().flatten().zip(other.iter().flatten()) {
        assert!((a - b).abs() < 1e-12, "{what}: {one:?} and {other:?}");
    }
}

#[test]
fn there_and_back_is_the_same_rotation_between_all_representations() {
    for order in EulerOrder::all() {
        assert_eq!(order.to_string().parse(), Ok(order));
        for Sample { angles, .. } in samples(order).into_iter().step_by(7) {
            let matrix = order.matrix(angles);
            near(
                &Quaternion::of_matrix(&matrix).matrix(),
                &matrix,
                "quaternion",
            );
            near(
                &AxisAngle::of_matrix(&matrix).matrix(),
                &matrix,
                "axis and angle",
            );
            let vector = to_rotation_vector(&matrix);
            near(&from_rotation_vector(vector), &matrix, "rotation vector");
            for other in EulerOrder::all() {
                let there = other.angles(&matrix);
                near(&other.matrix(there.angles), &matrix, &other.to_string());
            }
        }
    }
}

#[test]
fn angles_are_in_their_ranges_and_a_lock_is_told() {
    let mut locked = 0;
    for order in EulerOrder::all() {
        for Sample {
            angles,
            is_singular,
        } in samples(order)
        {
            let found = order.angles(&order.matrix(angles));
            let [first, middle, last] = found.angles;
            assert!(first.abs() <= PI && last.abs() <= PI, "{order}: {found:?}");
            assert!((-FRAC_PI_2..=PI).contains(&middle), "{order}: {found:?}");
            assert!(!found.is_locked || is_singular, "{order}: {angles:?}");
            locked += usize::from(found.is_locked);
        }
    }
    assert!(locked > 24, "{locked}");
}

#[test]
fn a_roll_a_pitch_and_a_yaw_are_those_of_ros() {
    // A robot that looks to its left and has its nose up: yaw 90°, pitch -90° would be locked.
    let matrix = EulerOrder::RPY.matrix([0.0, 0.0, FRAC_PI_2]);
    let quaternion = Quaternion::of_matrix(&matrix).to_xyzw();
    let half = 0.5_f64.sqrt();
    for (found, expected) in quaternion.into_iter().zip([0.0, 0.0, half, half]) {
        assert!((found - expected).abs() < 1e-15, "{quaternion:?}");
    }
    assert_eq!("rpy".parse(), Ok(EulerOrder::RPY));
    assert_eq!(EulerOrder::RPY.to_string(), "xyz fixed");
    for wrong in [
        "",
        "xyz",
        "xxy fixed",
        "xyz turning",
        "xyzx fixed",
        "xyz fixed now",
        "RPY",
    ] {
        assert!(wrong.parse::<EulerOrder>().is_err(), "{wrong}");
    }
}

#[test]
fn what_is_no_unit_quaternion_is_refused() {
    let unit = |parts| Quaternion::wxyz(parts).unit(1e-3);
    assert_eq!(unit([0.0; 4]), Err(NoRotation { norm: 0.0 }));
    assert_eq!(unit([1.2, 0.0, 0.0, 0.0]), Err(NoRotation { norm: 1.2 }));
    assert!(unit([f64::NAN, 0.0, 0.0, 1.0]).is_err());
    assert!(unit([f64::INFINITY, 0.0, 0.0, 1.0]).is_err());
    let normal = unit([0.0, 1.0005, 0.0, 0.0]).expect("a rotation");
    assert_eq!(normal, Quaternion::xyzw([1.0, 0.0, 0.0, 0.0]));
}
