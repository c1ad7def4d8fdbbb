//! The keywords of the languages of data: schemas of graphs, prototypes and solvers.

use super::Keyword;

/// The keywords by language and place: the first word of the block, or of the statement.
pub(crate) const DATA: [(&str, &str, &[Keyword]); 26] = [
    (
        "gdsl",
        "",
        &[
            (
                "import",
                "Imports another domain, or data prototypes: `import \"home.gdsl\";`",
            ),
            ("Domain", "The types of a graph."),
        ],
    ),
    (
        "gdsl",
        "domain",
        &[
            ("entity", "A type of nodes."),
            ("relation", "A type of edges, with its ends as members."),
            (
                "require",
                "A rule between attributes: `require a.low <= a.high of Part \"why\";`",
            ),
            (
                "query",
                "A query with a name: `query inside(Room room) \"MATCH …\";`",
            ),
        ],
    ),
    (
        "gdsl",
        "Domain",
        &[("open", "Graphs may have further types.")],
    ),
    (
        "gdsl",
        "entity",
        &[("composed_by", "The entities that it consists of.")],
    ),
    (
        "gdsl",
        "relation",
        &[
            (
                "tree",
                "Its edges make a tree: `tree of Place interpolated (pose);`",
            ),
            ("promotes", "An end has the attributes of the other one."),
        ],
    ),
    (
        "gdsl",
        "tree",
        &[
            ("of", "The root of the tree."),
            ("interpolated", "Poses between two times are computed."),
        ],
    ),
    (
        "gdsl",
        "rule",
        &[("of", "The entity whose attributes are compared.")],
    ),
    (
        "gdsl",
        "type",
        &[
            (
                "dproto",
                "The value has a data prototype: `place dproto at;`",
            ),
            ("topic", "The value is in a topic, not in the graph."),
        ],
    ),
    (
        "gdsl",
        "flags",
        &[
            ("unit", "The unit of the number: `unit \"mm\"`."),
            (
                "history",
                "How long earlier values are kept: `history 10s`.",
            ),
            (
                "consistency",
                "The attribute is the same value in another form: `consistency pose`.",
            ),
            ("key", "It tells the nodes of the type apart."),
            ("optional", "A node may lack it."),
        ],
    ),
    (
        "kdsl",
        "",
        &[
            ("import", "The robot: `import \"arm.urdf\";`"),
            ("Kinematics", "The solvers of the robot."),
        ],
    ),
    (
        "kdsl",
        "kinematics",
        &[
            ("solver", "Functions that are computed together."),
            ("posture", "Positions of joints, by name."),
            ("math", "The functions of the code: `math libm;`"),
            ("scalars", "The type of numbers in the code: `scalars f32;`"),
            ("lengths", "The unit of lengths in the code: `lengths mm;`"),
            (
                "matrices",
                "The order of numbers in the code: `matrices column_major;`",
            ),
            (
                "frames",
                "The axes of all frames in the code: `frames robocomp;`",
            ),
            (
                "fixed",
                "A robot stands on a frame: `fixed left.base in floor;`",
            ),
            ("planar", "A robot moves in the plane x, y of a frame."),
            ("floating", "A robot moves freely in a frame."),
            (
                "spherical",
                "A robot turns freely about the origin of a frame.",
            ),
            ("loop", "Frames that are at one place, and so close a loop."),
        ],
    ),
    (
        "kdsl",
        "loop",
        &[
            ("point", "Only the places are equal, not the rotations."),
            (
                "revolute",
                "The frames turn about this axis: `revolute 0, 0, 1;`",
            ),
            (
                "prismatic",
                "The frames slide along this axis: `prismatic 1, 0, 0;`",
            ),
        ],
    ),
    (
        "kdsl",
        "math",
        &[
            ("std", "Those of the standard library."),
            ("libm", "Those of libm, equal on each machine."),
        ],
    ),
    (
        "kdsl",
        "scalars",
        &[
            ("f64", "Numbers of 64 bits."),
            ("f32", "Numbers of 32 bits, not for searches and loops."),
        ],
    ),
    (
        "kdsl",
        "lengths",
        &[
            ("m", "Metres, as in a URDF."),
            ("mm", "Millimetres, for motions only."),
        ],
    ),
    (
        "kdsl",
        "matrices",
        &[
            ("row_major", "One row after the other."),
            ("column_major", "One column after the other."),
        ],
    ),
    (
        "kdsl",
        "frames",
        &[
            ("ros", "x ahead, y left, z up, as in a URDF."),
            ("ros_optical", "x right, y down, z ahead."),
            ("robocomp", "x right, y ahead, z up."),
            ("innermodel", "x right, y up, z ahead: left-handed."),
        ],
    ),
    (
        "kdsl",
        "solver",
        &[
            ("pose", "Where a frame is: `pose tool in base;`"),
            ("jacobian", "How velocities of joints move a frame."),
            ("velocity", "How fast a frame moves."),
            ("acceleration", "How a frame accelerates."),
            ("efforts", "The efforts of the joints for a motion."),
            ("mass_matrix", "The inertia of the robot at its joints."),
            (
                "accelerations",
                "The accelerations of the joints from efforts.",
            ),
            ("gravity", "The gravity, in m/s²: `gravity 0, 0, -9.81;`"),
            ("payload", "A mass that is carried: `payload part at hand;`"),
            (
                "inverse",
                "The joints for a pose or a velocity: `inverse pose tool in base;`",
            ),
            ("within", "Solutions keep the limits of the joints."),
            (
                "tolerance",
                "The largest error: `tolerance 1e-6 m 1e-6 rad;`",
            ),
            ("iterations", "The most steps of the solver."),
            (
                "restarts",
                "How often it starts again from another posture.",
            ),
            ("seed", "The posture from which it starts."),
            ("damped", "The damping near singular postures."),
            ("null", "What free joints do: `null posture home;`"),
            (
                "period",
                "The period of the loop, for limits of velocities.",
            ),
            (
                "loop_errors",
                "How far the frames of loops are from each other.",
            ),
            (
                "loop_jacobian",
                "How velocities of joints move these frames.",
            ),
            (
                "loop_forces",
                "Force and torque on the second frame of each loop.",
            ),
            (
                "closed_positions",
                "Positions near the given ones that close all loops.",
            ),
            (
                "closed_velocities",
                "Velocities that keep all loops closed.",
            ),
            (
                "holding",
                "Joints that stay where they are: `holding left.turn;`",
            ),
            (
                "passive",
                "Joints without a motor, which the loops move: `passive right.turn;`",
            ),
            (
                "actuator",
                "Numbers of motors, for those of joints: `actuator positions;`",
            ),
            (
                "joint",
                "Numbers of joints, for those of motors: `joint positions;`",
            ),
        ],
    ),
    (
        "kdsl",
        "driven",
        &[
            ("positions", "Where they are."),
            ("velocities", "How fast they move."),
            ("efforts", "Their torques and forces."),
        ],
    ),
    (
        "kdsl",
        "motion",
        &[
            ("in", "The frame that it is measured from."),
            ("expressed", "The frame of the axes: `expressed in base`."),
            ("as", "The form of the rotation: `as quaternion`."),
        ],
    ),
    (
        "kdsl",
        "inverse",
        &[
            ("pose", "The positions of joints for a pose."),
            ("velocity", "The velocities of joints for a velocity."),
        ],
    ),
    (
        "kdsl",
        "word",
        &[
            ("at", "The frame that carries it."),
            ("limits", "The limits of the joints."),
            ("posture", "A posture of this file."),
            ("gain", "How strongly it is followed."),
            ("quaternion", "The rotation is a quaternion."),
            ("rpy", "The angles of URDF, behind the place."),
        ],
    ),
    (
        "dproto",
        "",
        &[
            ("import", "Imports types, or other prototypes."),
            (
                "axes",
                "The directions of axes: `axes ros :: ahead, left, up`",
            ),
            (
                "algebraic",
                "Names of values: `algebraic xyz :: Scalar{x, y, z}`",
            ),
            (
                "ddr",
                "A type in memory: `ddr point :: IDSL{Module::Point}`",
            ),
            (
                "units",
                "The units of values: `units metres :: qudt, xyz { x = m, y = m, z = m }`",
            ),
            ("alias", "Two names for the same values."),
            ("view", "A type of which another one is a part."),
            ("conversion", "A function between two prototypes."),
            ("load", "Loads a library of functions."),
            ("fproto", "A function, with its arguments."),
            ("domain", "Meanings and coordinates."),
            (
                "dproto",
                "What a type means: `dproto measured :: geometry { semantic = Position }`",
            ),
        ],
    ),
    (
        "dproto",
        "algebraic",
        &[
            ("Scalar", "Single values: `Scalar{x, y, z}`"),
            ("Vector", "A vector: `Vector{3}`"),
            ("Matrix", "A matrix: `Matrix{3, 3}`"),
        ],
    ),
    ("dproto", "units", &[("qudt", "The vocabulary of units.")]),
    (
        "dproto",
        "value",
        &[("member", "A member of the type in memory.")],
    ),
];
