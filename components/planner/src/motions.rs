//! The motions among which a plan chooses.

/// The fastest turn that is tried, in rad/s.
const FASTEST_TURN: f64 = 1.2;

/// A constant speed of a base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    /// In mm/s.
    pub(crate) advance: f64,
    /// In rad/s.
    pub(crate) turn: f64,
}

/// Motions along `turns` arcs, from one side to the other one.
pub(crate) fn arcs(advance: f64, turns: u32) -> impl Iterator<Item = Motion> {
    let last = f64::from(turns.saturating_sub(1).max(1));
    (0..turns).map(move |number| Motion {
        advance,
        turn: FASTEST_TURN * (2.0 * f64::from(number) / last - 1.0),
    })
}

/// Turns on the spot, which are possible in front of a wall, too.
pub(crate) fn on_the_spot() -> [Motion; 2] {
    [-FASTEST_TURN, FASTEST_TURN].map(|turn| Motion { advance: 0.0, turn })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_go_from_side_to_side() {
        let turns: Vec<f64> = arcs(500.0, 3).map(|motion| motion.turn).collect();
        assert_eq!(turns, [-FASTEST_TURN, 0.0, FASTEST_TURN]);
        assert!(arcs(500.0, 9).all(|motion| motion.advance == 500.0));
        assert_eq!(arcs(500.0, 1).count(), 1);
    }
}
