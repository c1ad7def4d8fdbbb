//! Suggestions in a model in ILK: the values of fields, the names of poses, velocities and joints, and the fields.

use super::{Item, KEYWORD, VALUE, VARIABLE};
use rc_kinematics::ilk::OPERATIONS;

/// Fields of a model and of its tables, with their meanings.
const FIELDS: [(&str, &str); 31] = [
    ("solverid", "The name of the solver."),
    ("solver_type", "Only `forward` is read."),
    ("robot_name", "The name of the robot."),
    ("joint_space_size", "The number of joints."),
    (
        "joints",
        "Joints by names: `turn = { kind = 'revolute', coordinate = 0 }`.",
    ),
    ("kind", "How a joint moves."),
    (
        "coordinate",
        "The place of a joint in the positions, from 0.",
    ),
    ("poses", "The tables `constant` and `joint`."),
    (
        "constant",
        "Poses whose numbers are in model-constants.lua.",
    ),
    (
        "joint",
        "Poses that a joint moves, or the joint of an entry.",
    ),
    ("dir", "The frame of a joint in the other one."),
    ("joint_vel_twists", "Velocities that joints give."),
    ("joint_acc_twists", "Accelerations that joints give."),
    ("polarity", "1, or -1 for the way back."),
    (
        "ctransform",
        "The pose through which an acceleration, or a joint with the polarity -1, is seen.",
    ),
    ("ops", "The operations, in their order."),
    ("op", "The operation."),
    ("arg", "The velocity or acceleration of a joint."),
    ("arg1", "The first operand."),
    ("arg2", "The second operand."),
    ("res", "The name of the result."),
    ("pose", "A pose."),
    ("velocity", "The velocity of the frame of a result."),
    ("name", "The name of a Jacobian."),
    ("columns", "The columns of a Jacobian."),
    ("jac", "The Jacobian of a column."),
    ("col", "The place of a column, from 0."),
    ("joint_pose", "The pose of the frame of a joint."),
    ("outputs", "The results, by their names."),
    ("otype", "The kind of a result."),
    ("usersort", "The place of a result, from 1."),
];

fn values(field: &str) -> &'static [(&'static str, &'static str)] {
    match field {
        "op" => &OPERATIONS,
        "otype" => &[
            ("pose", "Where a frame is in another one."),
            ("velocity", "How fast a frame moves in another one."),
            ("acceleration", "How its velocity changes."),
            ("jacobian", "How velocities of joints move a frame."),
        ],
        "kind" => &[
            ("revolute", "It turns about z."),
            ("prismatic", "It slides along z."),
            ("fixed", "It moves nothing."),
        ],
        "dir" => &[
            (
                "a_x_b",
                "The frame that the joint moves, in that of the joint.",
            ),
            ("b_x_a", "The frame of the joint, in that which it moves."),
        ],
        "solver_type" => &[("forward", "Poses, motions and Jacobians of frames.")],
        _ => &[],
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The names that a text gives to poses, velocities and Jacobians, and those of joints.
fn names(text: &str, of_joints: bool) -> Vec<Item> {
    let mut words: Vec<&str> = Vec::new();
    for line in text.lines() {
        if of_joints {
            let kinds = line.match_indices("kind").map(|(at, _)| &line[..at]);
            // `turn = { kind`
            let before = kinds.map(|begin| begin.trim_end().trim_end_matches('{').trim_end());
            let before = before.filter_map(|begin| begin.strip_suffix('='));
            words
                .extend(before.filter_map(|begin| begin.trim_end().rsplit(|c| !is_word(c)).next()));
        } else {
            words.extend(
                line.split(|c| !is_word(c))
                    .filter(|word| word.contains("__")),
            );
        }
    }
    words.retain(|word| !word.is_empty());
    words.sort_unstable();
    words.dedup();
    let words = words.into_iter();
    words.map(|word| Item::new(VARIABLE, word, "")).collect()
}

/// The start of the word at a cursor, and what is allowed there.
pub(super) fn in_ilk(text: &str, cursor: usize) -> Option<(usize, Vec<Item>)> {
    let before = text.get(..cursor)?;
    let line = &before[before.rfind('\n').map_or(0, |at| at + 1)..];
    let table = |of: &[(&str, &str)], kind| -> Vec<Item> {
        let of = of.iter();
        of.map(|(word, doc)| Item::new(kind, *word, *doc)).collect()
    };
    let quotes = line.matches(['\'', '"']).count();
    if quotes % 2 == 0 {
        let start = before.trim_end_matches(is_word).len();
        return Some((start, table(&FIELDS, KEYWORD)));
    }
    let quote = before.rfind(['\'', '"'])?;
    let field = before[..quote].trim_end().strip_suffix('=')?.trim_end();
    let field = field.rsplit(|c| !is_word(c)).next()?;
    let items = match field {
        "joint" => names(text, true),
        "arg" | "arg1" | "arg2" | "pose" | "velocity" | "joint_pose" | "ctransform" | "jac" => {
            names(text, false)
        }
        _ => table(values(field), VALUE),
    };
    Some((quote + 1, items))
}
