//! The keywords that begin a statement.

use super::Keyword;

/// The keywords that may begin a statement, by language and by the first word of the block.
pub(crate) const STATEMENTS: [(&str, &str, &[Keyword]); 35] = [
    (
        "idsl",
        "",
        &[
            (
                "import",
                "Imports the types of another module: `import \"Units.idsl\";`",
            ),
            (
                "module",
                "The module of this file, with its types and interfaces.",
            ),
        ],
    ),
    (
        "idsl",
        "module",
        &[
            ("enum", "Named values, an int32 on the wire."),
            ("struct", "A type with members in order."),
            (
                "exception",
                "What an operation may throw, with members in order.",
            ),
            (
                "sequence",
                "A named sequence: `sequence<T> Name;`, bounded with `sequence<T, 64> Name;`",
            ),
            ("dictionary", "A named dictionary: `dictionary<K, V> Name;`"),
            ("const", "A constant: a number, a bool or a string."),
            (
                "interface",
                "Operations that a component implements, requires, publishes or subscribes to.",
            ),
        ],
    ),
    (
        "idsl",
        "interface",
        &[
            ("command", "An operation without a result."),
            ("query", "An operation with a result."),
            ("publish", "A topic, which is published and subscribed to."),
            (
                "idempotent",
                "The operation may be repeated without another effect.",
            ),
            ("void", "The operation returns nothing."),
        ],
    ),
    (
        "cdsl",
        "",
        &[
            (
                "import",
                "Imports the interfaces of a file: `import \"Laser.idsl\";`",
            ),
            ("Component", "The component of this file."),
        ],
    ),
    (
        "cdsl",
        "component",
        &[
            ("Communications", "The interfaces of the component."),
            ("language", "The language of the worker."),
            (
                "statemachine",
                "The file of the state machine: `.smdsl` or `.scxml`.",
            ),
            ("parameters", "The file of the parameters: `.pdsl`."),
            (
                "kinematics",
                "The solvers of a robot, for the worker: `kinematics \"arm.kdsl\" as arm;`",
            ),
            (
                "world",
                "A graph that components share: `world \"kitchen.gdsl\" as g { reads room; };`, or `world any as g;`",
            ),
            ("period", "The default period of `compute`, such as `50ms`."),
            ("dependencies", "The crates that the worker uses."),
            (
                "python",
                "The oldest version of Python: `python \"3.12\" venv;`",
            ),
            (
                "collect",
                "Topics whose samples one handler gets together: `collect a.scan, b.pose within 20ms as view;`",
            ),
            (
                "reactions",
                "What follows what: `reactions { scan -> compute; }`",
            ),
            (
                "simulates",
                "`simulates time;`: the component publishes the time of its network.",
            ),
            (
                "lifecycle",
                "`lifecycle managed;`: it has the life cycle of a managed node of ROS 2.",
            ),
            (
                "options",
                "Options of the component, such as `InnerModelViewer`.",
            ),
            (
                "gui",
                "`gui Qt(QWidget);`: the worker, in C++ or Python, is a window.",
            ),
        ],
    ),
    (
        "cdsl",
        "communications",
        &[
            ("implements", "Serves the calls of interfaces."),
            ("requires", "Calls interfaces of other components."),
            ("publishes", "Publishes the topics of interfaces."),
            ("subscribesTo", "Receives the topics of interfaces."),
        ],
    ),
    (
        "cdsl",
        "world",
        &[
            (
                "writes",
                "Types and attributes that the component sets: `writes door, door.pose stream 20ms;`",
            ),
            (
                "reads",
                "Types of which the component gets each change: `reads room, robot;`",
            ),
        ],
    ),
    (
        "cdsl",
        "reactions",
        &[("budget", "The longest run of a handler: `scan budget 3ms;`")],
    ),
    (
        "cdsl",
        "statemachine",
        &[(
            "external",
            "Events that may be fired from outside of the component.",
        )],
    ),
    (
        "ddsl",
        "",
        &[
            (
                "import",
                "Takes in the components of another network: `import \"arm.ddsl\";`",
            ),
            ("Deployment", "The network of this file."),
        ],
    ),
    ("ddsl", "deployment", NETWORK),
    ("ddsl", "group", NETWORK),
    (
        "ddsl",
        "chain",
        &[
            (
                "from",
                "The message that begins the chain: `COMPONENT.SLOT.OPERATION`.",
            ),
            ("through", "Components that it passes, in this order."),
            ("to", "The message that ends it."),
            (
                "external",
                "What programs outside of the network do: `external camera.Images.image -> tracker.Marks.found within 30ms;`.",
            ),
            ("within", "The most time from its beginning to its end."),
            ("age", "The most age of the data in its effects."),
            ("transport", "The most time of a message on its way."),
            (
                "late",
                "What is done if it is late: `warn`, `event`, `stop NAME`, `emergency NAME` or `fire NAME EVENT`.",
            ),
        ],
    ),
    (
        "ddsl",
        "world",
        &[
            (
                "schema",
                "The types of the world: `schema \"kitchen.gdsl\";`",
            ),
            ("start", "What is in it at first: `start \"home.graph\";`"),
            (
                "keep",
                "The file that keeps it, and how often it is written: `keep \"home.graph\" 30s;`",
            ),
        ],
    ),
    (
        "ddsl",
        "export",
        &[
            ("export", "The slots of a group that are visible outside."),
            (
                "proxy",
                "Outside, the group is one component: `proxy;`, or `proxy ros2;` for another middleware.",
            ),
        ],
    ),
    (
        "ddsl",
        "component",
        &[
            (
                "cdsl",
                "The `.cdsl` of the component, relative to this file.",
            ),
            (
                "executable",
                "The executable, if it is not the one that cargo builds.",
            ),
            (
                "config",
                "The configuration, if it is not `etc/config.toml` of the component.",
            ),
            (
                "endpoint",
                "The TCP address of its management, such as `\"10.0.0.2:7000\"`.",
            ),
            ("host", "The host that it runs on."),
            ("process", "The process whose thread it is."),
            (
                "after",
                "The components and groups that must be ready first.",
            ),
            (
                "restart",
                "When it restarts: `never`, `on_failure` or `always`.",
            ),
            ("ready", "The time in which it must be ready."),
            ("stop", "The time in which it must stop."),
            (
                "env",
                "Environment variables: `env { RUST_LOG \"debug\"; };`",
            ),
            ("args", "Further arguments of its command line."),
            ("cpu", "The processors that it may run on."),
            ("priority", "Its real-time priority, from 1 to 99."),
            (
                "parameters",
                "Values that take precedence over its configuration.",
            ),
            ("slots", "The members of its slot arrays."),
            ("middleware", "The middleware of its slots, with settings."),
            ("domain", "The domain of DDS."),
            ("time", "`time system;`: it has the clock of the system."),
            (
                "record",
                "`record { exact; };`: everything that decides its life is recorded.",
            ),
        ],
    ),
    (
        "ddsl",
        "process",
        &[
            ("host", "The host of all of its components."),
            ("restart", "When the process restarts as a whole."),
            ("cpu", "The processors of components that say none."),
            (
                "priority",
                "The real-time priority of components that say none.",
            ),
            ("Component", "A component that is a thread of this process."),
        ],
    ),
    (
        "ddsl",
        "host",
        &[
            ("address", "Host name or IP address."),
            ("user", "The user that runs components there."),
            ("workspace", "The folder for programs and files there."),
            (
                "link",
                "The capacity of its link to other hosts, such as `\"100 Mbit/s\"`.",
            ),
            ("arch", "Its processor: amd64, arm64, armhf or riscv64."),
            ("build", "Where its programs are built: `build there;`."),
        ],
    ),
    (
        "ddsl",
        "slots",
        &[("all", "The members are those of the scene.")],
    ),
    (
        "ddsl",
        "bind",
        &[(
            "convert",
            "The consumer, or a process of its own, converts what differs.",
        )],
    ),
    (
        "ddsl",
        "external",
        &[
            ("cdsl", "The file that describes the peer."),
            (
                "convert",
                "Converts values that mean something else at the peer.",
            ),
        ],
    ),
    (
        "ddsl",
        "convert",
        &[("frames", "The slot that knows where frames are that move.")],
    ),
    (
        "ddsl",
        "record",
        &[
            ("ring", "How long the last messages are kept in memory."),
            (
                "exact",
                "Everything that decides the component's life is recorded.",
            ),
        ],
    ),
    (
        "pdsl",
        "",
        &[
            (
                "import",
                "Takes in the parameters of another file: `import \"common.pdsl\";`",
            ),
            ("ComponentParams", "The parameters of this file."),
        ],
    ),
    ("pdsl", "componentparams", PARAMETERS),
    ("pdsl", "group", PARAMETERS),
    ("pdsl", "list", PARAMETERS),
    ("smdsl", "", &[]),
    ("smdsl", "machine", STATES),
    (
        "toml",
        "",
        &[
            ("component", "How the component runs."),
            ("bindings", "The address of the peers of each slot."),
            ("middleware", "The settings of middlewares, one table each."),
            ("parameters", "The parameters of the component."),
        ],
    ),
    (
        "toml",
        "component",
        &[
            ("period", "How often it computes, such as `\"50ms\"`."),
            (
                "log",
                "The least severe messages that are logged: `error`, `warn`, `info`, `debug` or `trace`.",
            ),
        ],
    ),
    (
        "cdsl",
        "options",
        &[
            (
                "InnerModelViewer",
                "The component shows its tree in a window.",
            ),
            (
                "InnerModelSlots",
                "The members of its slot arrays are the devices of its scene.",
            ),
            ("dsr", "An option of RoboComp, without effect."),
            ("agmagent", "An option of RoboComp, without effect."),
        ],
    ),
    (
        "cdsl",
        "gui",
        &[
            (
                "Qt",
                "The worker is a window of Qt: `Qt(QWidget)`, `Qt(QMainWindow)`, `Qt(QDialog)`.",
            ),
            ("egui", "A toolkit for which nothing is generated."),
        ],
    ),
    (
        "cdsl",
        "lifecycle",
        &[(
            "managed",
            "It has the life cycle of a managed node of ROS 2.",
        )],
    ),
    (
        "cdsl",
        "simulates",
        &[("time", "It publishes the time of its network.")],
    ),
];

const NETWORK: &[Keyword] = &[
    ("Component", "A component of the network, or of the group."),
    (
        "Process",
        "A process that runs several components as its threads.",
    ),
    ("Host", "A machine, by its address."),
    (
        "Group",
        "Components of which only exported slots are visible outside.",
    ),
    (
        "bind",
        "Connects a slot with the one that it takes its peer from: `bind a.Laser -> b.Laser;`",
    ),
    ("external", "Slots whose peers are not part of the network."),
    ("middleware", "The middleware of the slots, with settings."),
    ("domain", "The domain of DDS."),
    (
        "time",
        "`time simulated by NAME;`: a component publishes the time of the network.",
    ),
    (
        "record",
        "`record { ring 60s; };`: the last messages are kept in memory.",
    ),
    ("Chain", "What must follow what, and how soon."),
    (
        "World",
        "The graph that the components share: its schema and its files.",
    ),
    (
        "require",
        "A rule between parameters: `require filter.delay < base.period \"message\";`",
    ),
];

const PARAMETERS: &[Keyword] = &[
    (
        "group",
        "Parameters that belong together, a table of the configuration.",
    ),
    ("list", "A list of tables: `list motors 1:8 { … };`"),
    (
        "require",
        "A rule across parameters: `require low <= high \"message\";`",
    ),
];

const STATES: &[Keyword] = &[
    ("initial_state", "The state in which the block begins."),
    ("states", "Further states."),
    ("end_state", "The state that ends the block."),
    ("transitions", "What follows what: `a => b;`"),
];
