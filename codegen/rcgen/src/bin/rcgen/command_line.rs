//! The command line of `rcgen`.

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use rc_command_line::{ArgValueCandidates, CompletionCandidate, Tool, files, words};
use rc_deploy_network::Profile;
use rc_diagnostics::Format;
use rc_vocabulary::{Language, Middleware, duration, listed};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Duration;

pub(crate) const TOOL: Tool = Tool {
    name: "rcgen",
    completion_variable: "RCGEN_COMPLETE",
    exit_codes: &[
        (0, "Success."),
        (
            1,
            "The input is wrong, or with --check: something is not up to date.",
        ),
        (2, "The command line is wrong."),
        (
            3,
            "The system refused something, for example to read or to write a file.",
        ),
    ],
};

/// Generates components from their .cdsl files: a generic layer that is rewritten, and a worker
/// that is yours.
#[derive(Parser)]
#[command(
    name = "rcgen",
    version,
    args_conflicts_with_subcommands = true,
    arg_required_else_help = true
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) generate: Generate,
}

const FORMATS: [&str; 3] = ["human", "short", "json"];

fn codes() -> Vec<CompletionCandidate> {
    let pages = rcgen::explain::pages();
    pages
        .iter()
        .map(|page| CompletionCandidate::new(page.code))
        .collect()
}

/// The framework of new workspaces: the project that this program was built from, if it is on this
/// machine, otherwise this version. `cargo xtask dist` sets the variable: the folder would be in the
/// bytes of a package.
static FRAMEWORK: LazyLock<&str> = LazyLock::new(|| {
    let here = match option_env!("ROBOCOMP_PACKAGED") {
        Some(_) => None,
        None => Some(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")),
    };
    here.filter(|here| Path::new(here).is_dir())
        .unwrap_or(env!("CARGO_PKG_VERSION"))
});

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Makes a workspace for components, with a first network.
    Init {
        /// The folder of the workspace.
        dir: PathBuf,
        /// Where the framework's crates come from: a version (0.1), a git address (https://…,
        /// followed by ?branch=…, ?tag=… or ?rev=…), or a folder with this project. A folder inside
        /// the workspace, or in the same git repository, is named by a relative path.
        #[arg(long, value_name = "VERSION|GIT|PATH", default_value = *FRAMEWORK)]
        framework: String,
        /// Builds into the target folder of the framework, which must be a folder: cargo then
        /// compiles few crates of crates.io again. Programs of both are in one folder.
        #[arg(long)]
        shared_target: bool,
    },
    /// Makes a component in the workspace of the current folder, and generates it.
    New(New),
    /// Generates components: those named, or all of the workspace of the current folder.
    Generate(Generate),
    /// Removes generated code; `generate` makes it again. Everything else stays.
    Clean {
        /// Components, and folders with components [default: the workspace of the current folder].
        #[arg(value_name = "FILE.cdsl|FOLDER", add = files(&["cdsl"]))]
        paths: Vec<PathBuf>,
        /// Lists what would be removed, and removes nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Checks description files and configurations; reports all findings at once.
    Check {
        /// .idsl, .cdsl, .pdsl, .smdsl, .scxml, .ddsl, .gdsl, .dproto, .kdsl, .ilk, .urdf, .graph files,
        /// .json files of DSR, .xml files of InnerModel, .toml files in a component's etc/, and
        /// folders with any of them [default: the workspace of the current folder].
        #[arg(add = files(&["idsl", "cdsl", "pdsl", "smdsl", "scxml", "ddsl", "gdsl", "dproto", "kdsl", "ilk", "urdf", "graph", "json", "xml", "toml"]))]
        files: Vec<PathBuf>,
        /// Accepts files as RoboComp does: an operation that returns a value is allowed under
        /// subscribesTo, with a warning. Generating code for it is still refused.
        #[arg(long)]
        robocomp: bool,
        /// Fixes files, and checks them again, as `rcgen fix` does.
        #[arg(long)]
        fix: bool,
        #[command(flatten)]
        common: Common,
    },
    /// Fixes files, and checks them again: does what can only be meant, such as a missing `;`.
    Fix {
        /// Files and folders, as `check` takes them [default: the workspace of the current folder].
        #[arg(add = files(&["idsl", "cdsl", "pdsl", "smdsl", "scxml", "ddsl", "gdsl", "dproto", "kdsl", "ilk", "urdf", "graph", "json", "xml", "toml"]))]
        files: Vec<PathBuf>,
        /// Also takes near names, and adds missing imports and connections.
        #[arg(long)]
        likely: bool,
        #[command(flatten)]
        common: Common,
    },
    /// Serves an editor by the Language Server Protocol, over standard input and output: findings
    /// in open texts and in all files that read them, fixes, layout, and the pages of findings.
    Lsp {
        /// Looks for imported files here, too.
        #[arg(short = 'I', value_name = "DIR")]
        include: Vec<PathBuf>,
    },
    /// Formats description files, graphs and InnerModel files. Comments stay; a file with a syntax
    /// error stays as it is.
    Fmt {
        /// Files, and folders that hold them (`target` and `generated` are left out) [default: the
        /// workspace of the current folder].
        #[arg(add = files(&["idsl", "cdsl", "pdsl", "smdsl", "ddsl", "gdsl", "dproto", "kdsl", "ilk", "graph", "xml"]))]
        files: Vec<PathBuf>,
        /// Lists the files that are not formatted, exits with 1 if there is one, and writes
        /// nothing.
        #[arg(long)]
        check: bool,
        /// How findings are printed: human, short or json (one object a line).
        #[arg(long, default_value = "human", value_parser = |text: &str| text.parse::<Format>(), add = words(&FORMATS))]
        format: Format,
    },
    /// Brings the configuration of a component to what its .pdsl declares now.
    Config {
        /// Adds new parameters with comment and default, turns removed ones into comments, and
        /// renames a value if the rename is certain. All else stays as it is.
        #[arg(long, required = true)]
        update: bool,
        /// The component, whose etc/config.toml is meant, or a .toml file in a component's etc/.
        #[arg(value_name = "FILE.cdsl|FILE.toml", add = files(&["cdsl", "toml"]))]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// Lists what would change, and writes nothing.
        #[arg(long)]
        dry_run: bool,
        /// Fails with 1 if something would change, and writes nothing.
        #[arg(long)]
        check: bool,
    },
    /// Explains a diagnostic code with a wrong and a right example. Lists all codes without one.
    Explain {
        /// The code, such as unknown-type.
        #[arg(add = ArgValueCandidates::new(codes))]
        code: Option<String>,
    },
    /// Writes interfaces, with all that they import, in the language of another middleware; or an
    /// InnerModel file for other tools.
    Export {
        /// The interfaces: a file, or the name of one in an -I folder or of those that come with
        /// rcgen. To ros2 also a component, as a package that `ros2 run` and launch files start.
        /// To urdf and gltf an InnerModel file, to dsr, graphml, turtle and graph a graph, to
        /// rust, c, cpp, python, ctypes and ilk the solvers of a robot.
        #[arg(value_name = "FILE.idsl|FILE.cdsl|FILE.xml|FILE.graph|FILE.json|FILE.kdsl|FILE.ilk", add = files(&["idsl", "cdsl", "xml", "graph", "json", "kdsl", "ilk"]))]
        file: PathBuf,
        /// What to write: dds (OMG IDL 4.2), ros2 (packages), urdf, gltf (a scene as .glb), dsr
        /// (JSON), graphml, turtle (RDF, with the schema as SHACL), graph (the part of a domain); rust, c,
        /// cpp, python, ctypes or ilk (solvers as code).
        #[arg(long, value_name = "FORMAT", value_parser = target, add = words(&TARGETS))]
        to: Target,
        /// The folder that the files are written to.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Takes only the part of a graph whose types this domain of its schema declares, with the
        /// ends of its edges.
        #[arg(long, value_name = "NAME")]
        domain: Option<String>,
        #[command(flatten)]
        common: Common,
        /// Lists what would be written, and writes nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Makes an InnerModel file of a URDF file or a graph, or a graph of a URDF, InnerModel or DSR
    /// file; or joins graphs; or takes a graph over into another schema. Warnings list what does
    /// not fit.
    ///
    /// `rcgen import robocomp DIR --out WORKSPACE` takes over the components and networks of
    /// RoboComp below a folder, and lists what stays to be done, also in IMPORT.md. A file that
    /// exists stays as it is.
    Import {
        /// The robot, or the graph of DSR; or graphs to join, whose elements with the same id must be
        /// equal; or the word `robocomp` and a folder.
        #[arg(required = true, value_name = "FILE.urdf|FILE.xml|FILE.json|FILE.graph|robocomp DIR", add = files(&["urdf", "xml", "json", "graph"]))]
        files: Vec<PathBuf>,
        /// The new file, whose extension chooses the format; with `robocomp`, a folder.
        #[arg(long, value_name = "FILE.xml|FILE.graph|DIR")]
        out: PathBuf,
        /// The other schema of a graph. Lists what it declares otherwise than the present one; if
        /// an element does not fit it, writes nothing.
        #[arg(long, value_name = "FILE.gdsl", add = files(&["gdsl"]))]
        schema: Option<PathBuf>,
        #[command(flatten)]
        common: Common,
    },
    /// Runs a query, in openCypher, on a graph, and prints the rows. A query changes nothing.
    /// Without QUERY, it lists the queries of the schema.
    Query {
        /// The graph: a .graph file, a .json file of DSR, or the robot of a .urdf file.
        #[arg(value_name = "FILE", add = files(&["graph", "json", "urdf"]))]
        file: PathBuf,
        /// The name of a query of the schema, as in `people_in`, or a text, as in
        /// 'MATCH (p:person)-[:in]->(r:room) RETURN p.name'.
        #[arg(value_name = "QUERY")]
        query: Option<String>,
        /// Values of its parameters, as in `room=kitchen`. Those of a text that read as numbers are numbers.
        #[arg(value_name = "NAME=VALUE")]
        parameters: Vec<String>,
        /// Adds types and domains as nodes: `(n)-[:instance_of]->(t:Type)-[:instance_of]->(d:Domain)`,
        /// also from edges, and `(t)-[:is_a]->(u:Type)`.
        #[arg(long)]
        reflect: bool,
        /// The most steps that the query takes.
        #[arg(long, default_value_t = 10_000_000)]
        steps: u64,
        /// The most rows that the query makes, also on the way.
        #[arg(long, default_value_t = 100_000)]
        rows: usize,
        #[command(flatten)]
        common: Common,
    },
    /// Prints the handlers that src/ still lacks, ready to paste; writes nothing.
    Stubs {
        /// The component.
        #[arg(value_name = "FILE.cdsl", add = files(&["cdsl"]))]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// The component's folder [default: the folder of FILE].
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Makes the virtual environment `.venv` of a component in Python, or takes the one that is
    /// there, and installs the packages of its pyproject.toml and the framework: by uv if it is in
    /// the path, else by pip. No other command installs packages.
    Venv {
        /// The component.
        #[arg(value_name = "FILE.cdsl", add = files(&["cdsl"]))]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// The interpreter of a new environment [default: python3].
        #[arg(long, value_name = "PROGRAM")]
        python: Option<PathBuf>,
        /// Also installs the packages of `dev`, for tests and type checkers.
        #[arg(long)]
        dev: bool,
        /// The wheel of the framework [default: that of `cargo xtask dist` in its folder, else the
        /// one that is installed beside rcgen, if there is one].
        #[arg(long, value_name = "FILE.whl", add = files(&["whl"]))]
        wheel: Option<PathBuf>,
    },
    /// Installs components of a workspace under a prefix, with their programs, which are built
    /// before: `rcdeploy` finds them there without a workspace and without cargo.
    ///
    /// An installed component of the same name is replaced. A running one is not disturbed, and its
    /// next start is that of the new program.
    Install {
        /// The components.
        #[arg(required = true, value_name = "FILE.cdsl", add = files(&["cdsl"]))]
        files: Vec<PathBuf>,
        #[command(flatten)]
        common: Common,
        /// The prefix [default: `$ROBOCOMP_PREFIX`, else that of this program, else /opt/robocomp].
        #[arg(long, value_name = "DIR")]
        prefix: Option<PathBuf>,
        /// The profile with which cargo has built the programs: release or dev.
        #[arg(long, default_value = "release", value_parser = |text: &str| text.parse::<Profile>(), add = words(&["release", "dev"]))]
        profile: Profile,
        /// Replaces interfaces and other shared files that are installed in another version.
        /// Components that were built with those are stale then.
        #[arg(long)]
        replace: bool,
        /// Prints the files, and writes nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Draws a state machine, states in states, transitions with their events; or a graph, or the types
    /// of one with their relations.
    Graph {
        /// The machine, or the component that names it; the graph (.graph, or .json of DSR), or its
        /// schema.
        #[arg(value_name = "FILE", add = files(&["smdsl", "scxml", "cdsl", "graph", "json", "gdsl"]))]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// SVG, or text for Graphviz, which state machines have not [default: by the ending of the
        /// output, or svg].
        #[arg(long, value_name = "FORM")]
        to: Option<Form>,
        /// Writes to this file instead of standard output.
        #[arg(short, long, value_name = "FILE.svg|FILE.dot")]
        output: Option<PathBuf>,
    },
    /// Lists the components and interfaces of folders: who offers and needs what, languages, licences,
    /// and what is broken.
    Index {
        /// Folders, or files.
        #[arg(value_name = "DIR", required = true, add = files(&["cdsl", "idsl", ""]))]
        paths: Vec<PathBuf>,
        /// Looks for imported files here, too.
        #[arg(short = 'I', value_name = "DIR")]
        include: Vec<PathBuf>,
        /// Writes a page with a search (.html), or a document for programs and later comparisons (.json).
        #[arg(short, long, value_name = "FILE.json|FILE.html", add = files(&["json", "html"]))]
        output: Option<PathBuf>,
        /// Prints what has changed since an index that was written before. Fails with 1 if something is
        /// gone, or its messages are others.
        #[arg(long, value_name = "FILE.json", add = files(&["json"]))]
        since: Option<PathBuf>,
    },
    /// Prints all that the descriptions of a component say, on one page: what it is, its operations,
    /// what its values mean, its reactions, parameters and states, and what it needs.
    Datasheet {
        /// The component.
        #[arg(value_name = "FILE.cdsl", add = files(&["cdsl"]))]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// Markdown, HTML, or JSON as `rcgen view` prints it [default: by the ending of the output,
        /// or md].
        #[arg(long, value_name = "FORM")]
        to: Option<SheetForm>,
        /// Writes to this file instead of standard output.
        #[arg(short, long, value_name = "FILE.md|FILE.html|FILE.json", add = files(&["md", "html", "json"]))]
        output: Option<PathBuf>,
    },
    /// Prints the conversion from one data prototype to another one: type, distance, cost, and
    /// loss.
    Convert {
        /// The prototype that is converted.
        #[arg(value_name = "FROM", required_unless_present = "list")]
        from: Option<String>,
        /// The prototype that it becomes.
        #[arg(value_name = "TO", required_unless_present = "list")]
        to: Option<String>,
        /// Files with prototypes.
        #[arg(value_name = "FILE.dproto", required_unless_present = "list", add = files(&["dproto"]))]
        files: Vec<PathBuf>,
        #[command(flatten)]
        common: Common,
        /// Prints the conversion as a function in this language instead.
        #[arg(long = "to", value_name = "LANGUAGE")]
        language: Option<PrintedLanguage>,
        /// Prints the domain `geometry`: meanings, parts, coordinates and their conventions.
        #[arg(long, conflicts_with_all = ["from", "to", "files", "language"])]
        list: bool,
    },
    /// Prints a component, the data prototypes of a file, a robot with its solvers, or a graph with
    /// its schema as JSON for other generators. The form is independent of the language that is
    /// generated.
    View {
        /// The component, the prototypes, the solvers, the graph (.json is one of DSR), or the schema.
        #[arg(value_name = "FILE.cdsl|FILE.dproto|FILE.kdsl|FILE.ilk|FILE.graph|FILE.json|FILE.gdsl", add = files(&["cdsl", "dproto", "kdsl", "ilk", "graph", "json", "gdsl"]))]
        file: PathBuf,
        #[command(flatten)]
        common: Common,
        /// The middleware of every slot that does not choose one.
        #[arg(long, value_name = "NAME", value_parser = middleware, default_value_t = Middleware::DEFAULT, add = words(Middleware::words()))]
        middleware: Middleware,
    },
    #[command(flatten)]
    Common(rc_command_line::Common),
}

/// The forms of a picture.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Form {
    Svg,
    Dot,
}

/// The forms of a data sheet.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum SheetForm {
    Md,
    Html,
    Json,
}

/// The languages of printed solvers.
#[derive(Clone, Copy)]
pub(crate) enum SolverLanguage {
    Rust,
    C,
    Cpp,
    Python,
    /// Python that loads a library in C.
    Ctypes,
    /// Models for the compiler of ILK.
    Ilk,
}

/// The languages of printed conversions.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum PrintedLanguage {
    Rust,
    C,
    Python,
}

#[derive(Args)]
pub(crate) struct New {
    /// Name of the component.
    pub(crate) name: String,
    /// Interfaces that it serves, as in `--implements Laser,Speech`.
    #[arg(long, value_name = "INTERFACE", value_delimiter = ',')]
    pub(crate) implements: Vec<String>,
    /// Interfaces that it calls.
    #[arg(long, value_name = "INTERFACE", value_delimiter = ',')]
    pub(crate) requires: Vec<String>,
    /// Interfaces that it publishes.
    #[arg(long, value_name = "INTERFACE", value_delimiter = ',')]
    pub(crate) publishes: Vec<String>,
    /// Interfaces that it subscribes to.
    #[arg(
        long,
        value_name = "INTERFACE",
        value_delimiter = ',',
        alias = "subscribesTo"
    )]
    pub(crate) subscribes: Vec<String>,
    /// Its period, as in `50ms` [default: 100ms].
    #[arg(long, value_name = "DURATION", value_parser = period)]
    pub(crate) period: Option<Duration>,
    /// The language of its worker [default: rust, or that of the file after `--from`].
    #[arg(long, value_parser = PossibleValuesParser::new(Language::words()))]
    pub(crate) language: Option<String>,
    /// Starts with a copy of this description, under the new name.
    #[arg(long, value_name = "FILE.cdsl", conflicts_with_all = ["implements", "requires", "publishes", "subscribes", "period"])]
    pub(crate) from: Option<PathBuf>,
    /// The middleware of all slots that do not choose one: iceoryx2, dds or ros2; local for tests
    /// [default: iceoryx2].
    #[arg(long, value_parser = middleware, add = words(Middleware::words()))]
    pub(crate) middleware: Option<Middleware>,
    #[command(flatten)]
    pub(crate) common: Common,
}

fn period(text: &str) -> Result<Duration, String> {
    let period = duration::parse(text).map(Duration::from_nanos);
    let expected = "expected a duration with a unit, as in `50ms` or `1s`";
    period.ok_or_else(|| duration::unknown_unit(text).unwrap_or(expected).to_owned())
}

#[derive(Args, Default)]
pub(crate) struct Generate {
    /// Components, and folders with components of a workspace. For the folder of the workspace
    /// itself, the crate `interfaces` then contains exactly what components use and what the folder
    /// of interfaces contains.
    #[arg(value_name = "FILE.cdsl|FOLDER", add = files(&["cdsl"]))]
    pub(crate) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) common: Common,
    /// The component's folder [default: the folder of FILE].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// The middleware of all slots that do not choose one: iceoryx2, dds or ros2; local for tests
    /// [default: iceoryx2; in a FOLDER, the middleware that a component was generated for before].
    #[arg(long, value_parser = middleware, add = words(Middleware::words()))]
    pub(crate) middleware: Option<Middleware>,
    /// Generates this language, whatever the file says.
    #[arg(long, value_parser = PossibleValuesParser::new(Language::words()))]
    pub(crate) language: Option<String>,
    /// Lists what would be written, and writes nothing.
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Exits with 1 if generated/ is not up to date, and writes nothing.
    #[arg(long)]
    pub(crate) check: bool,
}

#[derive(Args, Default)]
pub(crate) struct Common {
    /// Looks for imported files here, too.
    #[arg(short = 'I', value_name = "DIR")]
    pub(crate) include: Vec<PathBuf>,
    /// How findings are printed: human, short or json (one object a line).
    #[arg(long, default_value = "human", value_parser = |text: &str| text.parse::<Format>(), add = words(&FORMATS))]
    pub(crate) format: Format,
}

pub(crate) fn middleware(text: &str) -> Result<Middleware, String> {
    Middleware::from_word(text).ok_or_else(|| {
        let near = rc_diagnostics::nearest(text, Middleware::words());
        near.map_or_else(
            || format!("there are {}", listed(Middleware::words(), "and")),
            |near| format!("did you mean `{near}`?"),
        )
    })
}

/// Format of an export.
#[derive(Clone, Copy)]
pub(crate) enum Target {
    Dds,
    Ros2,
    Urdf,
    Gltf,
    Dsr,
    Graphml,
    Turtle,
    Graph,
    /// Solvers as code.
    Code(SolverLanguage),
}

const TARGETS: [&str; 14] = [
    "dds", "ros2", "urdf", "gltf", "dsr", "graphml", "turtle", "graph", "rust", "c", "cpp",
    "python", "ctypes", "ilk",
];

pub(crate) fn target(text: &str) -> Result<Target, String> {
    let there = || {
        let (last, others) = (TARGETS[TARGETS.len() - 1], &TARGETS[..TARGETS.len() - 1]);
        format!("there are {} and {last}", others.join(", "))
    };
    match text {
        "dds" => Ok(Target::Dds),
        "ros2" => Ok(Target::Ros2),
        "urdf" => Ok(Target::Urdf),
        "gltf" => Ok(Target::Gltf),
        "dsr" => Ok(Target::Dsr),
        "graphml" => Ok(Target::Graphml),
        "turtle" => Ok(Target::Turtle),
        "graph" => Ok(Target::Graph),
        "rust" => Ok(Target::Code(SolverLanguage::Rust)),
        "c" => Ok(Target::Code(SolverLanguage::C)),
        "cpp" => Ok(Target::Code(SolverLanguage::Cpp)),
        "python" => Ok(Target::Code(SolverLanguage::Python)),
        "ctypes" => Ok(Target::Code(SolverLanguage::Ctypes)),
        "ilk" => Ok(Target::Code(SolverLanguage::Ilk)),
        "slice" => Err(format!("{text} comes with a later version; {}", there())),
        _ => {
            let near = rc_diagnostics::nearest(text, TARGETS.into_iter().chain(["slice"]));
            let hint = near.map(|near| format!("did you mean `{near}`?"));
            Err(hint.unwrap_or_else(there))
        }
    }
}
