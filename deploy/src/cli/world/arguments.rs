//! Arguments of `rcdeploy world`.

use crate::cli::arguments::{change, format};
use crate::cli::bag::duration;
use crate::cli::completion::networks;
use clap::{Args, Subcommand, ValueEnum};
use rc_command_line::{files, words};
use rc_deploy_client::Format;
use rc_world::Token;
use std::path::PathBuf;
use std::time::Duration;

/// The form of a picture.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum PictureFormat {
    Svg,
    Dot,
}

/// The world of a running network.
#[derive(Args)]
pub(crate) struct OfWorld {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    pub(crate) network: String,
    /// The form of the output: human or json.
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    pub(crate) format: Format,
}

#[derive(Subcommand)]
pub(crate) enum WorldAction {
    /// Shows elements with their attributes, or single attributes.
    Get {
        #[command(flatten)]
        of: OfWorld,
        /// A node by its name, an edge as `kitchen/RT/front`, either by its id as in `#17:4`; with an
        /// attribute as in `front.width`. Without it, all elements are listed.
        #[arg(value_name = "ELEMENT")]
        elements: Vec<String>,
        /// Waits until the world has the change that this token names, which a component has told, and answers from
        /// then on. At most 5 s.
        #[arg(long, value_name = "TOKEN")]
        after: Option<Token>,
    },
    /// Changes attributes, all in one version or none, and waits until all replicas have them.
    ///
    /// The change must fit the schema of the world. The component that writes an attribute may
    /// change it again.
    Set {
        #[command(flatten)]
        of: OfWorld,
        /// The changes, as in `front.width=0.9`, `front.width=90cm`, `kitchen/RT/front.pose=[1,0,0,0,0,0]`. Values are
        /// written as `get` prints them.
        #[arg(required = true, value_name = "ELEMENT.ATTRIBUTE=VALUE", value_parser = change)]
        changes: Vec<(String, String)>,
    },
    /// Prints what changes, until Ctrl-C.
    Watch {
        #[command(flatten)]
        of: OfWorld,
        /// Only elements of these types, and of those that inherit from them, or with these names.
        #[arg(value_name = "TYPE|ELEMENT")]
        words: Vec<String>,
        /// Ends after this many lines.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
        count: Option<u64>,
    },
    /// Asks the world in openCypher, as `rcgen query` asks a file.
    ///
    /// This starts the program `rcgen`.
    Query {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The name of a query of the schema, or a text, as in 'MATCH (d:door) RETURN d.name'. Without
        /// it, the queries of the schema are listed.
        #[arg(value_name = "QUERY")]
        query: Option<String>,
        /// Values of its parameters, as in `room=kitchen`.
        #[arg(value_name = "NAME=VALUE")]
        parameters: Vec<String>,
        /// Waits until the world has the change that this token names, which a component has told, and answers from
        /// then on. At most 5 s.
        #[arg(long, value_name = "TOKEN")]
        after: Option<Token>,
    },
    /// Draws the world: a box for each node, a line for each edge. Attributes are in tooltips.
    Graph {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The form of the picture: svg or dot.
        #[arg(long, default_value = "svg", add = words(&["svg", "dot"]))]
        format: PictureFormat,
        /// Writes to this file instead of standard output.
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Prints the frames of the world as an InnerModel file: for `rcview`, `rcis` and others that read one.
    ///
    /// `rcview --world NETWORK` shows them in a window.
    Tree {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// Writes to this file instead of standard output.
        #[arg(short, long, value_name = "FILE.xml", add = files(&["xml"]))]
        output: Option<PathBuf>,
        /// Prints one again whenever something has moved, each as a JSON text in a line, until Ctrl-C.
        #[arg(long, conflicts_with = "output")]
        follow: bool,
    },
    /// Writes the world into a .graph file, which names its schema.
    Save {
        #[command(flatten)]
        of: OfWorld,
        /// The file. It is replaced as a whole.
        #[arg(value_name = "FILE.graph", add = files(&["graph"]))]
        file: PathBuf,
    },
    /// Shows the world of a recording as it was at a time.
    ///
    /// `rcdeploy record` asks for the world when it begins, if it records all topics. The recording has it from then
    /// on, some seconds after its begin.
    At {
        /// The time since the beginning of the recording, as in `12.3s`.
        #[arg(value_name = "TIME", value_parser = duration)]
        time: Duration,
        /// The recording.
        #[arg(value_name = "FILE.mcap", add = files(&["mcap"]))]
        file: PathBuf,
        /// The schema of the world, also one that comes with the tools.
        #[arg(long, value_name = "FILE.gdsl", add = files(&["gdsl"]))]
        schema: PathBuf,
        /// Elements and attributes as of `get`. Without it, all elements.
        #[arg(value_name = "ELEMENT")]
        elements: Vec<String>,
        /// Writes the world into this file instead.
        #[arg(long, value_name = "FILE.graph", conflicts_with = "elements", add = files(&["graph"]))]
        save: Option<PathBuf>,
        /// The form of the output: human or json.
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Shows the differences between two worlds. The exit code is 1 if there are any.
    Diff {
        /// A network, one replica of it as in `home@mapper`, or a file (.graph, or .json of DSR).
        #[arg(value_name = "FIRST", add = networks())]
        first: String,
        /// The other one.
        #[arg(value_name = "SECOND", add = networks())]
        second: String,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
}
