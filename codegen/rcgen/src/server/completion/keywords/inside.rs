//! The keywords inside a statement.

use super::{CONDITION, Keyword};

/// The keywords that are allowed inside a statement, by language and by the first word of the
/// statement; `*` for any.
pub(crate) const INSIDE: [(&str, &str, &[Keyword]); 20] = [
    (
        "idsl",
        "exception",
        &[(
            "extends",
            "The exception has the members of another one first.",
        )],
    ),
    (
        "idsl",
        "interface",
        &[
            ("throws", "The exceptions of the operation."),
            ("out", "The parameter is a result."),
        ],
    ),
    (
        "cdsl",
        "communications",
        &[
            ("as", "The name of the slot."),
            ("optional", "The component works without a peer."),
        ],
    ),
    (
        "cdsl",
        "statemachine",
        &[("visual", "The machine is shown in a window.")],
    ),
    (
        "cdsl",
        "python",
        &[("venv", "`rcdeploy up --build` makes a virtual environment.")],
    ),
    (
        "cdsl",
        "world",
        &[(
            "any",
            "The schema is that of the network, whichever it has.",
        )],
    ),
    (
        "cdsl",
        "writes",
        &[
            (
                "stream",
                "Only the newest value of the attribute counts: `door.pose stream 20ms`.",
            ),
            ("shared", "Other components write it, too."),
        ],
    ),
    (
        "cdsl",
        "wake",
        &[("spin", "Polls for this time before it sleeps.")],
    ),
    (
        "cdsl",
        "serve",
        &[(
            "latest",
            "The last value of the worker answers queries for this time, without a handler.",
        )],
    ),
    (
        "cdsl",
        "collect",
        &[
            (
                "within",
                "The most time between the first and the last sample: `within 20ms`.",
            ),
            ("exact", "Samples of equal times, in simulated time."),
            ("as", "What the worker calls it."),
        ],
    ),
    ("ddsl", "external", &[("at", "The address of the peer.")]),
    (
        "ddsl",
        "middleware",
        &[("remote", "The middleware between hosts: dds, or ros2.")],
    ),
    (
        "ddsl",
        "time",
        &[
            ("simulated", "A component publishes the time."),
            ("by", "The component that publishes it."),
            ("system", "The clock of the system."),
        ],
    ),
    (
        "ddsl",
        "restart",
        &[
            ("hung", "Also if the loop has not turned for this time."),
            ("max", "The most restarts: `max 3 within 1min`."),
            ("within", "The time in which restarts are counted."),
            ("backoff", "The pause before a restart."),
        ],
    ),
    (
        "ddsl",
        "build",
        &[
            (
                "jobs",
                "How many processors of the host compile at once: `jobs 2`.",
            ),
            ("nice", "The niceness of the build on the host: `nice 10`."),
        ],
    ),
    (
        "pdsl",
        "*",
        &[
            ("T", "May be changed while the component runs."),
            ("F", "Fixed at start."),
            ("unit", "The unit of the number: `unit \"mm\"`."),
            ("restart", "A change takes effect at the next start."),
            ("secret", "The value is never shown."),
            (
                "reads",
                "The component reads this file when it starts: `reads \"innermodel\"`.",
            ),
            (
                "element",
                "An element of a file that another parameter names: `element \"joint\" of scene`.",
            ),
            ("of", "The parameter that names the file."),
        ],
    ),
    ("pdsl", "require", CONDITION),
    ("ddsl", "require", CONDITION),
    (
        "ddsl",
        "convert",
        &[("via", "Another process converts: `convert via process;`")],
    ),
    (
        "smdsl",
        ":",
        &[("parallel", "All states of the block are active together.")],
    ),
];
