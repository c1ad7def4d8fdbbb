//! Transforms, and what they do to twists, wrenches and covariances.

use rc_quantity::rotation::{EulerOrder, Quaternion, to_rotation_vector};
use rc_quantity::{Layout, Spatial, Transform, covariance};

fn transform() -> Transform {
    Transform {
        rotation: EulerOrder::RPY.matrix([0.3, -0.7, 1.9]),
        translation: [1.0, -2.0, 0.5],
    }
}

#[test]
fn homogeneous_matrices_are_read_as_they_are_written() {
    let transform = transform();
    let rows = transform.homogeneous(Layout::RowMajor);
    assert_eq!(rows[3], 1.0);
    assert_eq!(rows[12..], [0.0, 0.0, 0.0, 1.0]);
    let columns = transform.homogeneous(Layout::ColumnMajor);
    assert_eq!(columns[12..15], [1.0, -2.0, 0.5]);
    for (numbers, layout) in [(rows, Layout::RowMajor), (columns, Layout::ColumnMajor)] {
        assert_eq!(Transform::of_homogeneous(&numbers, layout), transform);
    }
    let there = transform.point([0.1, 0.2, 0.3]);
    let back = transform.inverse().point(there);
    for (found, expected) in back.into_iter().zip([0.1, 0.2, 0.3]) {
        assert!((found - expected).abs() < 1e-15);
    }
}

#[test]
fn power_is_the_same_in_both_frames() {
    let power = |twist: &Spatial, wrench: &Spatial| -> f64 {
        let parts = twist.angular.iter().zip(wrench.angular);
        let parts = parts.chain(twist.linear.iter().zip(wrench.linear));
        parts.map(|(a, b)| a * b).sum()
    };
    let twist = Spatial {
        angular: [0.1, 0.2, -0.3],
        linear: [1.0, 2.0, 3.0],
    };
    let wrench = Spatial {
        angular: [-4.0, 0.5, 6.0],
        linear: [7.0, -8.0, 9.0],
    };
    let transform = transform();
    let there = power(&transform.twist(&twist), &transform.wrench(&wrench));
    assert!((there - power(&twist, &wrench)).abs() < 1e-12);
}

/// A number of the normal distribution (Box and Muller).
fn normal(random: &mut fastrand::Rng) -> f64 {
    let (radius, angle) = ((1.0 - random.f64()).ln() * -2.0, random.f64());
    radius.sqrt() * (std::f64::consts::TAU * angle).cos()
}

/// The covariance of 10^5 samples through a conversion is within 2 % of the propagated one, of the
/// greatest number of its diagonal.
fn sampled<const M: usize>(of: impl Fn(&[f64; 3]) -> [f64; M]) {
    let at = [0.4, -0.3, 1.1];
    // The lower triangle of a root of the covariance.
    let root = [
        [0.004, 0.0, 0.0],
        [0.001, 0.003, 0.0],
        [-0.002, 0.001, 0.005],
    ];
    let mut own = [[0.0; 3]; 3];
    for (row, values) in own.iter_mut().enumerate() {
        for (column, value) in values.iter_mut().enumerate() {
            *value = (0..3).map(|k| root[row][k] * root[column][k]).sum();
        }
    }
    let found = covariance(&of, &at, &own, 1e-6);
    let mut random = fastrand::Rng::with_seed(5);
    let mean = of(&at);
    let mut sums = [[0.0; M]; M];
    let count = 100_000;
    for _ in 0..count {
        let three: [f64; 3] = std::array::from_fn(|_| normal(&mut random));
        let moved = std::array::from_fn(|row| {
            at[row] + (0..3).map(|k| root[row][k] * three[k]).sum::<f64>()
        });
        let value = of(&moved);
        for row in 0..M {
            for column in 0..M {
                sums[row][column] += (value[row] - mean[row]) * (value[column] - mean[column]);
            }
        }
    }
    let most = (0..M).map(|k| found[k][k]).fold(0.0, f64::max);
    for row in 0..M {
        for column in 0..M {
            let sample = sums[row][column] / f64::from(count);
            let difference = (sample - found[row][column]).abs();
            assert!(
                difference < 0.02 * most,
                "{row}, {column}: {sample} {found:?}"
            );
        }
    }
}

#[test]
fn covariances_of_converted_rotations_equal_those_of_samples() {
    sampled(|angles| Quaternion::of_matrix(&EulerOrder::RPY.matrix(*angles)).to_wxyz());
    sampled(|angles| to_rotation_vector(&EulerOrder::RPY.matrix(*angles)));
    for order in EulerOrder::all().step_by(5) {
        sampled(move |angles| order.angles(&EulerOrder::RPY.matrix(*angles)).angles);
    }
    sampled(|place| transform().point(*place));
}
