//! Poses in printed Rust, whose types name their frames: a pose in another frame does not compile.

use crate::ast::MotionPart;
use crate::cell::{Cell, Output};
use crate::inverse::{Inverse, Question};
use crate::names::{identifier, is_taken};
use std::collections::{BTreeMap, HashSet};
use std::fmt::Write as _;

/// The names of the types of frames, by the places of their bodies.
pub(super) struct Frames(BTreeMap<usize, String>);

impl Frames {
    /// The frames of the poses of a cell.
    pub(super) fn of(cell: &Cell) -> Self {
        let outputs = cell.solvers.iter().flat_map(|solver| &solver.outputs);
        let inverses = cell.inverses.iter();
        let of_inverses = inverses.filter(|one| matches!(one.asked, Question::Pose(_)));
        let all = outputs
            .filter_map(frames)
            .chain(of_inverses.map(|one| one.frames));
        let mut places: Vec<usize> = all.flatten().collect();
        places.sort_unstable();
        places.dedup();
        let mut known = HashSet::new();
        let name = |at: usize| {
            let mut name = identifier(&cell.robot.bodies[at].name);
            let is_number = name.starts_with(|first: char| first.is_ascii_digit());
            if is_number || name == "_" || is_taken(&name) {
                name.insert_str(0, "frame_");
            }
            while !known.insert(name.clone()) {
                name.push('_');
            }
            (at, name)
        };
        Self(places.into_iter().map(name).collect())
    }

    fn pose(&self, frames: [usize; 2]) -> Option<String> {
        let [tip, base] = frames.map(|at| self.0.get(&at));
        Some(format!("Pose<frames::{}, frames::{}>", tip?, base?))
    }

    /// The type of an output that is a pose.
    pub(super) fn of_output(&self, output: &Output) -> Option<String> {
        self.pose(frames(output)?)
    }

    /// The type of the argument of an inverse solver of a pose.
    pub(super) fn of_inverse(&self, inverse: &Inverse) -> String {
        self.pose(inverse.frames).unwrap_or_default()
    }

    /// The arguments of an inverse solver, with their types.
    pub(super) fn arguments(&self, count: usize, inverse: &Inverse) -> Vec<(String, String)> {
        let one = |name: &str, kind: String| (name.to_owned(), kind);
        let joints = format!("&[f64; {count}]");
        match &inverse.asked {
            Question::Pose(search) => {
                let target = one("target", format!("&{}", self.of_inverse(inverse)));
                let last = search.seed.is_none().then(|| one("last", joints));
                std::iter::once(target).chain(last).collect()
            }
            Question::Velocity(_) => vec![
                one("positions", joints),
                one("velocity", "&[f64; 6]".to_owned()),
            ],
        }
    }

    /// The types; nothing without a pose.
    pub(super) fn text(&self, cell: &Cell) -> String {
        if self.0.is_empty() {
            return String::new();
        }
        let mut out = String::from("\n/// The frames of poses, as types.\npub mod frames {\n");
        for (at, name) in &self.0 {
            let link = cell.robot.bodies[*at].name.replace(char::is_control, " ");
            let _ = writeln!(
                out,
                "    /// The frame of `{link}`.\n    #[derive(Clone, Copy, Debug, PartialEq)]\n    pub enum {name} {{}}"
            );
        }
        out.push_str("}\n");
        // The array of a matrix by columns is that of the transposed one.
        let (one, other, place) = if cell.choices.by_columns {
            ("next", "self", "all[3][at]")
        } else {
            ("self", "next", "all[at][3]")
        };
        let own = |at: usize| {
            if cell.choices.by_columns {
                format!("own[at][{at}] * own[3][{at}]")
            } else {
                format!("own[{at}][at] * own[{at}][3]")
            }
        };
        let _ = write!(
            out,
            "
/// Where the frame `Tip` is in `Base`: the homogeneous matrix for columns. It dereferences to the array of its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<Tip, Base> {{
    numbers: [[f64; 4]; 4],
    frames: core::marker::PhantomData<(Tip, Base)>,
}}

impl<Tip, Base> Pose<Tip, Base> {{
    /// The pose with these numbers, whatever frames they are of.
    pub const fn new(numbers: [[f64; 4]; 4]) -> Self {{
        Self {{ numbers, frames: core::marker::PhantomData }}
    }}

    /// Where a frame is in the base of this pose, if it is there in its tip.
    pub fn then<Next>(&self, next: &Pose<Next, Tip>) -> Pose<Next, Base> {{
        let (one, other) = (&{one}.numbers, &{other}.numbers);
        let sum = |row: usize, at: usize| {{
            let own = &one[row];
            own[0] * other[0][at] + own[1] * other[1][at] + own[2] * other[2][at] + own[3] * other[3][at]
        }};
        Pose::new(core::array::from_fn(|row| core::array::from_fn(|at| sum(row, at))))
    }}

    /// Where the base is in the tip.
    pub fn inverse(&self) -> Pose<Base, Tip> {{
        let own = &self.numbers;
        let mut all = [[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        for at in 0..3 {{
            for other in 0..3 {{
                all[at][other] = own[other][at];
            }}
            {place} = -({} + {} + {});
        }}
        Pose::new(all)
    }}
}}

impl<Tip, Base> core::ops::Deref for Pose<Tip, Base> {{
    type Target = [[f64; 4]; 4];
    fn deref(&self) -> &Self::Target {{
        &self.numbers
    }}
}}

impl<Tip, Base> core::ops::DerefMut for Pose<Tip, Base> {{
    fn deref_mut(&mut self) -> &mut Self::Target {{
        &mut self.numbers
    }}
}}
",
            own(0),
            own(1),
            own(2)
        );
        out
    }
}

/// The frames of an output that is a pose.
fn frames(output: &Output) -> Option<[usize; 2]> {
    let asked = output
        .asked
        .filter(|asked| asked.what == MotionPart::Pose)?;
    Some([asked.tip, asked.base])
}
