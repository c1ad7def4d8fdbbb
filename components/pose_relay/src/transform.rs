//! Poses in the types of tf2.

use pose_relay_generated::{Quaternion, Time, network_time};

/// A time of the network in a message. A time after 2038 is 0, which means that it is unknown.
pub(crate) fn stamp(now: network_time::Time) -> Time {
    const SECOND: u64 = 1_000_000_000;
    let nanoseconds = now.as_nanos();
    match i32::try_from(nanoseconds / SECOND) {
        Ok(sec) => Time {
            sec,
            nanosec: (nanoseconds % SECOND) as u32,
        },
        Err(_) => Time::default(),
    }
}

/// The unit quaternion of the rotation Rx·Ry·Rz by angles in radians, as the product of the three
/// quaternions.
pub(crate) fn rotation(rx: f64, ry: f64, rz: f64) -> Quaternion {
    let [(sx, cx), (sy, cy), (sz, cz)] = [rx, ry, rz].map(|angle| (angle / 2.0).sin_cos());
    Quaternion {
        x: sx * cy * cz + cx * sy * sz,
        y: cx * sy * cz - sx * cy * sz,
        z: sx * sy * cz + cx * cy * sz,
        w: cx * cy * cz - sx * sy * sz,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// The vector `v`, rotated by `q`: the vector part of q·v·q*.
    fn rotated(q: &Quaternion, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [tx, ty, tz] = [
            2.0 * (q.y * z - q.z * y),
            2.0 * (q.z * x - q.x * z),
            2.0 * (q.x * y - q.y * x),
        ];
        [
            x + q.w * tx + q.y * tz - q.z * ty,
            y + q.w * ty + q.z * tx - q.x * tz,
            z + q.w * tz + q.x * ty - q.y * tx,
        ]
    }

    /// Rotates a point by matrices: about z, then y, then x.
    fn by_matrices([rx, ry, rz]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (s, c) = rz.sin_cos();
        let (x, y) = (c * x - s * y, s * x + c * y);
        let (s, c) = ry.sin_cos();
        let (x, z) = (c * x + s * z, -s * x + c * z);
        let (s, c) = rx.sin_cos();
        [x, c * y - s * z, s * y + c * z]
    }

    #[test]
    fn a_rotation_is_that_of_the_three_angles() {
        let vector = [1.0, -2.0, 0.5];
        for angles in [[0.0, 0.0, 1.2], [0.3, -0.8, 2.5], [3.1, 1.5, -3.0]] {
            let [rx, ry, rz] = angles;
            let (is, expected) = (
                rotated(&rotation(rx, ry, rz), vector),
                by_matrices(angles, vector),
            );
            for (is, expected) in is.iter().zip(expected) {
                assert!((is - expected).abs() < 1e-12, "{angles:?}: {is} {expected}");
            }
        }
    }

    #[test]
    fn a_time_is_in_seconds_and_nanoseconds() {
        let after = |since: Duration| stamp(network_time::Time::ZERO + since);
        let time = after(Duration::new(1_700_000_000, 5));
        assert_eq!((time.sec, time.nanosec), (1_700_000_000, 5));
        assert_eq!(after(Duration::from_secs(1 << 32)), Time::default());
    }
}
