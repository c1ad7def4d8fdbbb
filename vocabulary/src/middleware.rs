//! The middlewares, and what each of them can do.

use crate::key::{DDS, Key, ROS2};
use crate::word::words;

/// A middleware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Middleware {
    /// iceoryx2: shared memory on one machine.
    Iceoryx2,
    /// Cyclone DDS: a network of machines.
    Dds,
    /// ROS 2: a network of machines, with ROS 2 nodes as peers.
    Ros2,
    /// Inside one process, for tests.
    Local,
}

/// Differences of a middleware, for code that handles all of them alike.
#[derive(Debug)]
pub struct Capabilities {
    /// The word in files and on command lines.
    pub word: &'static str,
    /// Other words that files may have for it.
    pub aliases: &'static [&'static str],
    /// The crate of the backend, and its folder in the framework.
    pub package: (&'static str, &'static str),
    /// The settings.
    pub keys: &'static [Key],
    /// Whether components in different processes reach each other. If not, only the command line
    /// of `rcgen` selects it, no file.
    pub joins_processes: bool,
    /// Whether components on different machines reach each other.
    pub joins_machines: bool,
    /// Whether messages travel in shared memory, whose services a supervisor can hold.
    pub shares_memory: bool,
    /// Whether its peers are nodes of ROS 2. Then it has the names, types, parameters and command
    /// line of ROS 2.
    pub has_nodes: bool,
    /// The dash pattern of its connections in a drawing: lengths of dashes and gaps. Empty: solid.
    pub dashes: &'static str,
    /// The option after which a component takes the arguments of nodes, up to `--`.
    pub node_arguments: Option<&'static str>,
}

words!(Middleware);

static ICEORYX2_CAN: Capabilities = Capabilities {
    word: "iceoryx2",
    aliases: &[],
    package: ("rc-iceoryx2", "middleware/iceoryx2"),
    keys: &[],
    joins_processes: true,
    joins_machines: false,
    shares_memory: true,
    has_nodes: false,
    dashes: "",
    node_arguments: None,
};

static DDS_CAN: Capabilities = Capabilities {
    word: "dds",
    aliases: &[],
    package: ("rc-dds", "middleware/dds"),
    keys: &DDS,
    joins_processes: true,
    joins_machines: true,
    shares_memory: false,
    has_nodes: false,
    dashes: "7 3",
    node_arguments: None,
};

static ROS2_CAN: Capabilities = Capabilities {
    word: "ros2",
    aliases: &["ros"],
    package: ("rc-ros2", "middleware/ros2"),
    keys: &ROS2,
    joins_processes: true,
    joins_machines: true,
    shares_memory: false,
    has_nodes: true,
    dashes: "2 3",
    node_arguments: Some("--ros-args"),
};

static LOCAL_CAN: Capabilities = Capabilities {
    word: "local",
    aliases: &[],
    package: ("rc-local", "middleware/local"),
    keys: &[],
    joins_processes: false,
    joins_machines: false,
    shares_memory: false,
    has_nodes: false,
    dashes: "9 3 2 3",
    node_arguments: None,
};

impl Middleware {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 4] = [Self::Iceoryx2, Self::Dds, Self::Ros2, Self::Local];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        self.can().word
    }

    /// The middleware where nothing else is said.
    pub const DEFAULT: Self = Self::Iceoryx2;

    /// The middleware between hosts where nothing else is said.
    pub const BETWEEN_HOSTS: Self = Self::Dds;

    /// The middleware inside one process.
    pub const IN_PROCESS: Self = Self::Local;

    /// Its capabilities.
    pub fn can(self) -> &'static Capabilities {
        match self {
            Self::Iceoryx2 => &ICEORYX2_CAN,
            Self::Dds => &DDS_CAN,
            Self::Ros2 => &ROS2_CAN,
            Self::Local => &LOCAL_CAN,
        }
    }

    /// The middlewares that files can select.
    pub fn in_files() -> impl Iterator<Item = Self> + Clone {
        let all = Self::ALL.into_iter();
        all.filter(|middleware| middleware.can().joins_processes)
    }

    /// The middleware that a word of a file selects, in either case.
    pub fn from_file(word: &str) -> Option<Self> {
        Self::in_files().find(|middleware| {
            let mut words = middleware
                .can()
                .aliases
                .iter()
                .chain([&middleware.can().word]);
            words.any(|known| known.eq_ignore_ascii_case(word))
        })
    }

    /// The setting `name`.
    pub fn key(self, name: &str) -> Option<&'static Key> {
        self.can().keys.iter().find(|key| key.name == name)
    }

    /// Crate names with `_`, as Rust writes them.
    pub fn module(self) -> String {
        self.can().package.0.replace('-', "_")
    }
}

/// The middlewares that a component is generated for: that of slots which choose none, and others
/// over which a network may connect them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Middlewares {
    main: Middleware,
    /// One bit for each, by its place in [`Middleware::ALL`].
    all: u8,
}

impl Middlewares {
    /// These middlewares: `main`, and others.
    pub fn new(main: Middleware, others: impl IntoIterator<Item = Middleware>) -> Self {
        let bits = others.into_iter().chain([main]).map(|one| 1 << one as u8);
        Self {
            main,
            all: bits.fold(0, |all, bit| all | bit),
        }
    }

    /// The middleware of slots that choose none.
    pub fn main(self) -> Middleware {
        self.main
    }

    /// All of them, the main one first.
    pub fn iter(self) -> impl Iterator<Item = Middleware> {
        let others = Middleware::ALL.into_iter();
        let others = others.filter(move |one| *one != self.main && self.contains(*one));
        std::iter::once(self.main).chain(others)
    }

    /// Whether it is one of them.
    pub fn contains(self, middleware: Middleware) -> bool {
        self.all & (1 << middleware as u8) != 0
    }
}

impl From<Middleware> for Middlewares {
    fn from(middleware: Middleware) -> Self {
        Self::new(middleware, [])
    }
}

impl std::fmt::Display for Middlewares {
    /// `iceoryx2-local`: the main one first.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.main.word())?;
        self.iter()
            .skip(1)
            .try_for_each(|other| write!(f, "-{}", other.word()))
    }
}

impl std::str::FromStr for Middlewares {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let words = text.split('-').map(Middleware::from_word);
        let all = words.collect::<Option<Vec<_>>>().ok_or(())?;
        let main = *all.first().ok_or(())?;
        Ok(Self::new(main, all))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_have_a_text_with_the_main_one_first() {
        let several = Middlewares::new(Middleware::Dds, [Middleware::Local, Middleware::Iceoryx2]);
        assert_eq!(several.to_string(), "dds-iceoryx2-local");
        assert_eq!(several.to_string().parse(), Ok(several));
        assert_eq!(
            "iceoryx2".parse(),
            Ok(Middlewares::from(Middleware::DEFAULT))
        );
        assert_eq!("iceoryx2-pigeon".parse::<Middlewares>(), Err(()));
        assert!(!several.contains(Middleware::Ros2));
    }

    #[test]
    fn files_select_all_but_those_of_one_process() {
        assert_eq!(Middleware::from_file("ROS"), Some(Middleware::Ros2));
        assert_eq!(Middleware::from_file("Iceoryx2"), Some(Middleware::DEFAULT));
        assert_eq!(Middleware::from_file("local"), None);
        let words: Vec<&str> = Middleware::words().collect();
        assert_eq!(words, ["iceoryx2", "dds", "ros2", "local"]);
        for middleware in Middleware::ALL {
            assert_eq!(Middleware::from_word(middleware.word()), Some(middleware));
        }
    }
}
