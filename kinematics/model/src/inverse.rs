//! Positions and velocities of joints for those of a frame.
//!
//! [`pose`] and [`velocity`] are loops over numbers that are lent to them. Printed code contains
//! the same text: [`TEXT`].

#[expect(
    clippy::float_cmp,
    clippy::needless_range_loop,
    clippy::neg_cmp_op_on_partial_ord,
    clippy::eq_op,
    clippy::suboptimal_flops,
    clippy::too_many_lines,
    reason = "the text is printed for other projects, like the loops in C"
)]
mod core;

pub use self::core::{Aim, Found, Wish, nearest, pose, room, velocity, within};

/// The loops as text of Rust, without dependencies.
pub const TEXT: &str = include_str!("inverse/core.rs");

/// The positions where searches begin again: `count` for each joint, between the limits, in an order
/// whose beginning already is everywhere (the sequence R of M. Roberts, 2018, by the generalised golden
/// ratio). A list is the beginning of a longer one.
///
/// `ranges` are the least and greatest positions of joints, which are finite.
pub fn starts(ranges: &[(f64, f64)], count: usize) -> Vec<f64> {
    let mut ratio: f64 = 2.0;
    #[expect(clippy::cast_precision_loss, reason = "small numbers")]
    let of_joints = ranges.len() as f64 + 1.0;
    for _ in 0..60 {
        ratio = (1.0 + ratio).powf(1.0 / of_joints);
    }
    let mut starts = Vec::with_capacity(count * ranges.len());
    let mut places = vec![0.5; ranges.len()];
    for _ in 0..count {
        let mut step = 1.0;
        for (place, (lower, upper)) in places.iter_mut().zip(ranges) {
            step /= ratio;
            *place = (*place + step) % 1.0;
            starts.push(lower + *place * (upper - lower));
        }
    }
    starts
}
