//! `rcdeploy`: checks a network, starts it, watches it, stops it.
//!
//! Exit codes: 0 done, also an `up` that was ended by Ctrl-C; 1 the input is wrong; 2 wrong usage; 3 the system
//! refused or a component failed.
mod top;

use crate::guard::services;
use crate::process::machine;
use crate::{CommandResult, Format, GuardCommand, Options, Verb};
use clap::{ArgAction, Args, Parser, Subcommand};
use rc_cdsl::model::Backend;
use rc_codegen::FileLoader;
use rc_codegen::files::Change;
use rc_codegen::view::BACKENDS;
use rc_deploy_client::{connection as client, params, status};
use rc_deploy_export::{self as export, Engine};
use rc_deploy_graph::{Graph, GraphFormat};
use rc_deploy_network::{Network, Profile};
use rc_deploy_terminal::SideView;
use rc_diagnostics::{Diagnostics, SourceMap, render};
use rc_management::component::ParameterStatus;
use rc_middleware::RunDirectory;
use serde::Serialize;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, ExitCode};
use std::time::Duration;

/// Runs networks of components: all is checked before anything starts.
#[derive(Parser)]
#[command(name = "rcdeploy", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Checks a whole network before anything starts.
    Check {
        #[command(flatten)]
        input: Input,
        /// How findings are printed: human, short or json (one object a line).
        #[arg(long, default_value = "human", value_parser = |text: &str| text.parse::<rc_diagnostics::Format>())]
        format: rc_diagnostics::Format,
    },
    /// Tells what `up` would do, and does none of it: order, hosts, files, connections, policies.
    Plan {
        #[command(flatten)]
        input: Input,
        /// human, or json: one document.
        #[arg(long, default_value = "human", value_parser = format)]
        format: Format,
        /// Looks at the descriptions alone, not at what is generated and built, nor at what this version can start.
        #[arg(long)]
        unbuilt: bool,
    },
    /// Draws a network: components, groups, hosts, who talks to whom, and in red what is wrong.
    ///
    /// The picture is also written where the check finds errors; the exit code is 1 then.
    Graph {
        #[command(flatten)]
        input: Input,
        /// svg, mermaid, dot or json (one document).
        #[arg(long, default_value = "svg", value_parser = |text: &str| text.parse::<GraphFormat>())]
        format: GraphFormat,
        /// Where it goes; standard output where this is left out.
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Looks at the descriptions alone, not at what is generated and built, nor at what this version can start.
        #[arg(long)]
        unbuilt: bool,
    },
    /// Checks a network, starts it, and keeps it until Ctrl-C.
    Up {
        #[command(flatten)]
        input: Input,
        /// Builds its components first, with cargo. Those whose generated/ is for another middleware than the network
        /// says are built for that one below target/rc; what is in their folders stays as it is.
        #[arg(long)]
        build: bool,
        /// Leaves it running in the background; `rcdeploy down` ends it.
        #[arg(long)]
        detach: bool,
        /// Prints events as lines, also where a terminal could show the network live.
        #[arg(long)]
        plain: bool,
        /// How events are printed: human or json (one object a line).
        #[arg(long, default_value = "human", value_parser = format)]
        format: Format,
        /// How many MiB a log may have. A longer one becomes the older part beside it, in the place of the one before.
        #[arg(long, value_name = "MIB", default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
        log_limit: u64,
        #[arg(long, hide = true)]
        supervisor: bool,
    },
    /// Shows a network that is up live, as `up` does: states, processors, memory, rates, times, events, logs,
    /// parameters and connections. The network goes on when this is left.
    Top {
        /// The network or its .ddsl; may be left out where only one is up.
        network: Option<String>,
    },
    /// Ends a network that is up.
    Down {
        /// The network or its .ddsl; may be left out where only one is up.
        network: Option<String>,
    },
    /// Tells what a network that is up is doing.
    Status {
        /// The network or its .ddsl; may be left out where only one is up.
        network: Option<String>,
        /// human, or json: one document.
        #[arg(long, default_value = "human", value_parser = format)]
        format: Format,
    },
    /// Prints what components have written.
    Logs {
        /// The network or its .ddsl.
        network: String,
        /// One component; all where it is left out.
        component: Option<String>,
        /// Goes on until Ctrl-C.
        #[arg(short, long)]
        follow: bool,
        /// How many lines of what was written already.
        #[arg(short = 'n', long, default_value_t = 100)]
        lines: usize,
        /// human or json (one object a line).
        #[arg(long, default_value = "human", value_parser = format)]
        format: Format,
    },
    /// Starts components that do not run, each after those that it needs, and waits until they are ready.
    Start(Named),
    /// Stops components, those first that need others of them. They stay so until they are started; what needs them
    /// runs on without them.
    Stop(Named),
    /// Stops components, then starts them again.
    Restart(Named),
    /// Has a component enter its emergency, or leave it. It does not matter whether rcdeploy has started it.
    Emergency {
        /// The network or its .ddsl.
        network: String,
        /// The component.
        name: String,
        /// on or off.
        #[arg(action = ArgAction::Set, value_parser = switch)]
        active: bool,
    },
    /// Shows the parameters of a running component, changes them, and saves what was changed.
    ///
    /// `params NETWORK NAME` shows all of them. It does not matter whether rcdeploy has started the component.
    #[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
    Params {
        #[command(subcommand)]
        action: Option<Action>,
        /// The network or its .ddsl.
        #[arg(required = true)]
        network: Option<String>,
        /// The component.
        #[arg(required = true)]
        name: Option<String>,
        /// human, or json: one document.
        #[arg(long, default_value = "human", value_parser = format)]
        format: Format,
    },
    /// Writes a network for an engine of another kind: equal programs, order, limits and policies. What the engine
    /// cannot do is told, and stands in the files.
    Export {
        #[command(flatten)]
        input: Input,
        /// The engine: systemd (units), compose (a file for `docker compose`) or kubernetes (manifests).
        #[arg(long, value_name = "ENGINE", value_parser = engine)]
        to: Engine,
        /// The folder that the files are written to.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// The container image, of compose (default: debian:stable-slim) and kubernetes.
        #[arg(long)]
        image: Option<String>,
        /// Lists what would be written, and writes nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// What the supervisor of another machine runs here, over ssh; started by `up`.
    #[command(hide = true)]
    Agent,
    /// The process that cleans up when its supervisor is gone; started by `up`.
    #[command(hide = true)]
    Guard {
        #[arg(long)]
        network: String,
        /// The services that it holds open, as JSON.
        #[arg(long, default_value = "[]")]
        hold: String,
    },
}

#[derive(Subcommand)]
enum Action {
    /// Shows some of them, as `PATH = VALUE`.
    Get {
        #[command(flatten)]
        of: Running,
        /// Which, as in `speed` or `motors[2].max`; of a group or a list all that is in it.
        #[arg(required = true, value_name = "PATH")]
        paths: Vec<String>,
    },
    /// Changes values, all or none.
    Set {
        #[command(flatten)]
        of: Running,
        /// What is to be, as in `speed=300`, `period=200ms`, `gains=[1,2,3]` or `name=left`; a secret as in `token=-`,
        /// which reads a line of standard input.
        #[arg(required = true, value_name = "PATH=VALUE", value_parser = change)]
        changes: Vec<(String, String)>,
    },
    /// Writes what was changed into the configuration file, which keeps its comments and its order.
    Save {
        #[command(flatten)]
        of: Running,
    },
}

/// Components of a network that is up.
#[derive(Args)]
struct Named {
    /// The network or its .ddsl.
    network: String,
    /// Components by their whole names, or groups with all that is in them.
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    /// human, or json: one document.
    #[arg(long, default_value = "human", value_parser = format)]
    format: Format,
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("an emergency is on or off".to_owned()),
    }
}

/// A component that runs.
#[derive(Args)]
struct Running {
    /// The network or its .ddsl.
    network: String,
    /// The component.
    name: String,
    /// human, or json: one document.
    #[arg(long, default_value = "human", value_parser = format)]
    format: Format,
}

fn change(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((path, value)) => Ok((path.trim().to_owned(), value.to_owned())),
        None => Err("a change looks like `speed=300`".to_owned()),
    }
}

#[derive(Args)]
struct Input {
    /// The network.
    #[arg(value_name = "FILE.ddsl")]
    file: PathBuf,
    /// Looks for imported files here, too.
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Which executables cargo has built: release or dev.
    #[arg(long, default_value = "release", value_parser = |text: &str| text.parse::<Profile>())]
    profile: Profile,
    /// Takes all components for this middleware, whatever the files say: iceoryx2, dds or ros2. They are built below
    /// target/rc, by `up --build`; what is in their folders stays as it is.
    #[arg(long, value_parser = middleware)]
    middleware: Option<Backend>,
}

fn middleware(text: &str) -> Result<Backend, String> {
    let all = BACKENDS.into_iter().filter(|b| *b != Backend::Local);
    let words: Vec<&str> = all.clone().map(Backend::word).collect();
    let found = all.clone().find(|backend| backend.word() == text);
    found.ok_or_else(
        || match rc_diagnostics::nearest(text, words.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", words.join(" and ")),
        },
    )
}

fn engine(text: &str) -> Result<Engine, String> {
    let words = Engine::WORDS.map(|(word, _)| word);
    let found = Engine::WORDS.into_iter().find(|(word, _)| *word == text);
    found
        .map(|(_, engine)| engine)
        .ok_or_else(|| match rc_diagnostics::nearest(text, words) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", words.join(", ")),
        })
}

fn format(text: &str) -> Result<Format, String> {
    match text {
        "human" => Ok(Format::Human),
        "json" => Ok(Format::Json),
        other => Err(format!(
            "`{other}` is not a format; there are human and json"
        )),
    }
}

/// How a command ended, other than well, and what is still to be said of it.
struct Failure(u8, String);

impl From<rc_deploy_network::Error> for Failure {
    fn from(error: rc_deploy_network::Error) -> Self {
        let code = match error {
            rc_deploy_network::Error::Workspace(_) => 1,
            _ => 3,
        };
        Self(code, error.to_string())
    }
}

impl From<crate::Error> for Failure {
    fn from(error: crate::Error) -> Self {
        Self(error.exit_code(), error.to_string())
    }
}

fn system(error: &dyn std::fmt::Display) -> Failure {
    Failure(3, error.to_string())
}

/// Prints a line; a reader that has left is no failure.
fn print_line(line: std::fmt::Arguments<'_>) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// The whole of `rcdeploy`.
pub fn main() -> ExitCode {
    match run(Cli::parse().command) {
        Ok(code) => ExitCode::from(code),
        Err(Failure(code, message)) => {
            if !message.is_empty() {
                rc_deploy_client::error::print_error(format_args!("rcdeploy: error: {message}"));
            }
            ExitCode::from(code)
        }
    }
}

fn run(command: Command) -> Result<u8, Failure> {
    match command {
        Command::Check { input, format } => check(&input, format),
        Command::Plan {
            input,
            format,
            unbuilt,
        } => {
            let human = rc_diagnostics::Format::Human;
            let network = load(&input, human, examine(&input, unbuilt))?;
            let preview = network.preview(input.profile).map_err(|e| system(&e))?;
            show(format, &preview, ToString::to_string)
        }
        Command::Graph {
            input,
            format,
            output,
            unbuilt,
        } => graph(&input, format, output.as_deref(), unbuilt),
        Command::Up {
            input,
            build,
            detach,
            plain,
            format,
            log_limit,
            supervisor,
        } => {
            let screen =
                !plain && !supervisor && format == Format::Human && rc_deploy_terminal::usable();
            let options = Options {
                format,
                relay: !supervisor && !screen,
                view: screen
                    .then_some(|network, covers| Box::new(SideView::start(network, covers))),
                supervisor,
                guard: None,
                log_limit: Some(log_limit << 20),
                memory_pause: None,
                services: BTreeMap::new(),
            };
            up(&input, build, detach, &options)
        }
        Command::Top { network } => top::top(&named(network)?),
        Command::Down { network } => {
            let network = named(network)?;
            // Components have limits of their own; this one is for a supervisor that does not answer.
            crate::down(&network, Duration::from_mins(1))?;
            Ok(0)
        }
        Command::Status { network, format } => {
            let status = crate::status(&named(network)?)?;
            show(format, &status, status::table)
        }
        Command::Logs {
            network,
            component,
            follow,
            lines,
            format,
        } => {
            let network = network_of(&network)?;
            let out = &mut std::io::stdout();
            rc_deploy_client::logs::print(
                &network,
                component.as_deref(),
                lines,
                follow,
                format,
                out,
            )?;
            Ok(0)
        }
        Command::Start(named) => tell(Verb::Start, &named),
        Command::Stop(named) => tell(Verb::Stop, &named),
        Command::Restart(named) => tell(Verb::Restart, &named),
        Command::Emergency {
            network,
            name,
            active,
        } => {
            params::emergency(&network_of(&network)?, &name, active)?;
            Ok(0)
        }
        Command::Params {
            action: Some(action),
            ..
        } => params(action),
        Command::Params {
            network,
            name,
            format,
            ..
        } => {
            let network = network_of(&network.unwrap_or_default())?;
            let listed = params::list(&network, &name.unwrap_or_default(), &[])?;
            show(format, &listed, params::table)
        }
        Command::Export {
            input,
            to,
            out,
            image,
            dry_run,
        } => export(&input, to, &out, image.as_deref(), dry_run),
        Command::Agent => {
            // Its own exit code is for nobody: it tells its supervisor what is wrong.
            let _ = crate::agent(&wipe);
            Ok(0)
        }
        Command::Guard { network, hold } => {
            let held = RefCell::new(services::hold(&network, &hold));
            let clean = || {
                held.take();
                wipe(&network);
            };
            // Its own exit code is for nobody: whoever started it is gone.
            let _ = crate::guard(&network, &clean);
            Ok(0)
        }
    }
}

/// Has components started or stopped, and says what has become of them.
fn tell(verb: Verb, named: &Named) -> Result<u8, Failure> {
    let result = client::command(&network_of(&named.network)?, verb, &named.names)?;
    let lines = |result: &CommandResult| -> String {
        let word = match verb {
            Verb::Start => "ready",
            Verb::Stop => "stopped",
            Verb::Restart => "ready again",
        };
        let done = result.done.iter();
        done.map(|name| format!("{name}: {word}\n")).collect()
    };
    if named.format == Format::Json || !result.done.is_empty() {
        show(named.format, &result, lines)?;
    }
    for failed in &result.failed {
        eprintln!("rcdeploy: error: {}: {}", failed.name, failed.reason);
    }
    Ok(if result.failed.is_empty() { 0 } else { 3 })
}

fn params(action: Action) -> Result<u8, Failure> {
    match action {
        Action::Get { of, paths } => {
            let listed = params::list(&network_of(&of.network)?, &of.name, &paths)?;
            show(of.format, &listed, |listed| {
                let line =
                    |p: &ParameterStatus| format!("{} = {}\n", p.path, params::text(&p.value));
                listed.parameters.iter().map(line).collect()
            })
        }
        Action::Set { of, changes } => {
            for (at, (path, _)) in changes.iter().enumerate() {
                if changes[..at].iter().any(|(before, _)| before == path) {
                    return Err(Failure(2, format!("`{path}` is given twice")));
                }
            }
            let (network, name) = (network_of(&of.network)?, of.name);
            let values = params::values(&network, &name, &changes, &mut std::io::stdin().lock())?;
            let changed = params::set(&network, &name, &values)?;
            show(of.format, &changed, |changed| {
                let now = changed
                    .changed
                    .iter()
                    .map(|c| format!("{}\n", params::change_text(c)));
                let later = changed.pending.iter();
                let later = later.map(|c| {
                    let change = params::change_text(c);
                    format!("{change}, at the next start if it is saved\n")
                });
                let lines: String = now.chain(later).collect();
                if lines.is_empty() {
                    "these are the values already\n".to_owned()
                } else {
                    lines
                }
            })
        }
        Action::Save { of } => {
            let saved = params::save(&network_of(&of.network)?, &of.name)?;
            show(of.format, &saved, |saved| {
                let file = saved.file.display();
                if saved.saved.is_empty() {
                    return format!("{file}: nothing has changed\n");
                }
                let lines = saved.saved.iter();
                let lines = lines.map(|change| format!("  {}\n", params::change_text(change)));
                format!("{file}\n{}", lines.collect::<String>())
            })
        }
    }
}

/// Prints an answer.
fn show<T: Serialize>(
    format: Format,
    answer: &T,
    human: impl FnOnce(&T) -> String,
) -> Result<u8, Failure> {
    match format {
        Format::Human => print_line(format_args!("{}", human(answer).trim_end())),
        Format::Json => print_line(format_args!(
            "{}",
            serde_json::to_string(answer).map_err(|e| system(&e))?
        )),
    }
    Ok(0)
}

/// Removes what the default middleware keeps in memory for a network.
fn wipe(network: &str) {
    if let Err(error) = rc_iceoryx2::wipe(&RunDirectory::of(network)) {
        rc_deploy_client::error::print_error(format_args!(
            "rcdeploy: the shared memory of {network} was not removed: {error}"
        ));
    }
}

/// The network that an argument names, or the only one that is up.
fn named(argument: Option<String>) -> Result<String, Failure> {
    if let Some(argument) = argument {
        return network_of(&argument);
    }
    match client::networks().as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(Failure(3, "no network is up".to_owned())),
        many => Err(Failure(
            2,
            format!("several networks are up: {}; name one", many.join(", ")),
        )),
    }
}

/// A network is named by its name or by its file, which may have changed since, or be broken by now: then it is the
/// network that was started from it.
fn network_of(argument: &str) -> Result<String, Failure> {
    let path = Path::new(argument);
    if path.extension().is_none_or(|e| e != "ddsl") {
        return Ok(argument.to_owned());
    }
    let mut sources = SourceMap::new();
    let read = std::fs::read_to_string(path).map(|text| {
        let source = sources.add(path, text);
        rc_ddsl::parse(&sources, source)
    });
    let deployment = read.as_ref().ok().and_then(|(f, _)| f.deployment.as_ref());
    let named = deployment.map(|deployment| deployment.name.text.clone());
    if let Some(name) = &named
        && client::networks().contains(name)
    {
        return Ok(name.clone());
    }
    match (client::started_from(path).as_slice(), named) {
        ([one], _) => Ok(one.clone()),
        (_, Some(name)) => Ok(name),
        ([], None) => {
            let (_, found) = read.map_err(|e| system(&format!("{}: {e}", path.display())))?;
            let human = rc_diagnostics::Format::Human;
            eprint!("{}", render(&sources, &found, human));
            Err(Failure(1, String::new()))
        }
        (many, None) => Err(Failure(
            2,
            format!(
                "several networks were started from {}: {}; name one",
                path.display(),
                many.join(", ")
            ),
        )),
    }
}

/// Reads a network and all that it names, with `more` that is to be looked at; says what is wrong.
fn read(
    input: &Input,
    format: rc_diagnostics::Format,
    more: impl FnOnce(&Network, &mut Diagnostics),
) -> Result<(Option<Network>, SourceMap, Diagnostics), Failure> {
    let mut sources = SourceMap::new();
    let loader = FileLoader::new(&input.include);
    let (network, mut found) =
        rc_deploy_network::load(&input.file, input.middleware, &mut sources, &loader)
            .map_err(|e| system(&format!("{}: {e}", input.file.display())))?;
    if let Some(network) = &network {
        more(network, &mut found);
    }
    eprint!("{}", render(&sources, &found, format));
    Ok((network, sources, found))
}

/// The same where only a network without errors is of use.
fn load(
    input: &Input,
    format: rc_diagnostics::Format,
    more: impl FnOnce(&Network, &mut Diagnostics),
) -> Result<Network, Failure> {
    let (network, _, found) = read(input, format, more)?;
    network
        .filter(|_| !found.has_errors())
        .ok_or(Failure(1, String::new()))
}

/// What is looked at where nothing is to be started.
fn examine(input: &Input, unbuilt: bool) -> impl FnOnce(&Network, &mut Diagnostics) {
    move |network, found| {
        if !unbuilt {
            machine::check(network, false, found);
            network.check_generated(found);
            network.check_executables(input.profile, found);
        }
    }
}

fn graph(
    input: &Input,
    format: GraphFormat,
    output: Option<&Path>,
    unbuilt: bool,
) -> Result<u8, Failure> {
    let human = rc_diagnostics::Format::Human;
    let (network, sources, found) = read(input, human, examine(input, unbuilt))?;
    // There is nothing to draw where not even the name of the network can be read.
    let network = network.ok_or(Failure(1, String::new()))?;
    let graph = Graph::of(&network, &sources, &found);
    let text = graph.draw(format).map_err(|e| system(&e))?;
    match output {
        Some(path) => {
            write(path, &text).map_err(|e| system(&format!("{}: {e}", path.display())))?;
        }
        None => print_line(format_args!("{}", text.trim_end())),
    }
    Ok(u8::from(found.has_errors()))
}

/// Writes a file, all or nothing; a device or a pipe is written into.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    if path.metadata().is_ok_and(|file| !file.is_file()) {
        return std::fs::write(path, text);
    }
    // A link stays one.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}", std::process::id()));
    let beside = path.with_file_name(name);
    let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, &path));
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written
}

fn check(input: &Input, format: rc_diagnostics::Format) -> Result<u8, Failure> {
    let network = load(input, format, examine(input, false))?;
    if format == rc_diagnostics::Format::Human {
        let (components, connections) = (
            network.projects.len(),
            network.connections.connections.len(),
        );
        print_line(format_args!(
            "{}: {components} components, {connections} connections, nothing wrong",
            network.name()
        ));
    }
    Ok(0)
}

fn up(input: &Input, build: bool, detach: bool, options: &Options) -> Result<u8, Failure> {
    let human = rc_diagnostics::Format::Human;
    let network = if build {
        let network = load(input, human, |network, found| {
            machine::check(network, true, found);
            network.check_generated(found);
        })?;
        cargo_build(&network, input.profile)?;
        let mut found = Diagnostics::new();
        network.check_executables(input.profile, &mut found);
        if found.is_empty() {
            network
        } else {
            load(input, human, |n, f| n.check_executables(input.profile, f))?
        }
    } else {
        load(input, human, |network, found| {
            machine::check(network, true, found);
            network.check_executables(input.profile, found);
        })?
    };
    let plan = network.plan(input.profile).map_err(|e| system(&e))?;
    if detach {
        let mut command = Process::new(std::env::current_exe().map_err(|e| system(&e))?);
        command
            .arg("up")
            .arg(&input.file)
            .args(["--supervisor", "--format", "json"]);
        command.args(["--profile", input.profile.word()]);
        if let Some(bytes) = options.log_limit {
            command.args(["--log-limit", &(bytes >> 20).to_string()]);
        }
        if let Some(middleware) = input.middleware {
            command.args(["--middleware", middleware.word()]);
        }
        input.include.iter().for_each(|dir| {
            command.arg("-I").arg(dir);
        });
        let outcome = crate::detach(&plan, command);
        if let Some(message) = outcome.message() {
            return Err(Failure(outcome.exit_code(), message));
        }
        print_line(format_args!(
            "{}",
            status::table(&crate::status(&plan.network)?).trim_end()
        ));
        return Ok(outcome.exit_code());
    }
    let own = GuardCommand::own().map_err(|e| system(&e))?;
    let args = own
        .args
        .into_iter()
        .chain(["--hold".to_owned(), network.services(None)])
        .collect();
    let options = Options {
        guard: Some(GuardCommand { args, ..own }),
        services: network.services_elsewhere(),
        ..options.clone()
    };
    let name = plan.network.clone();
    Ok(crate::up(&plan, &options, &|| wipe(&name)).exit_code())
}

fn export(
    input: &Input,
    engine: Engine,
    out: &Path,
    image: Option<&str>,
    dry_run: bool,
) -> Result<u8, Failure> {
    let network = load(input, rc_diagnostics::Format::Human, |_, _| {})?;
    let plan = network.plan(input.profile).map_err(|e| system(&e))?;
    let export = export::export(&network, &plan, engine, image).map_err(|e| Failure(1, e))?;
    let steps = export.files.plan(out).map_err(|e| system(&e))?;
    let foreign = rc_codegen::export::first_foreign_file(&steps, out, export::FIRST_WORDS);
    if let Some(foreign) = foreign.map_err(|e| system(&e))? {
        return Err(Failure(
            2,
            format!(
                "{} is there, and was not written by an export; name another folder",
                foreign.display()
            ),
        ));
    }
    for note in &export.notes {
        eprintln!("rcdeploy: note: {note}");
    }
    let programs: BTreeSet<&Path> = plan.components.iter().map(|c| &*c.executable).collect();
    for program in programs.into_iter().filter(|program| !program.exists()) {
        let program = program.display();
        eprintln!("rcdeploy: note: {program} is not built yet");
    }
    if !dry_run {
        export.files.write(out).map_err(|e| system(&e))?;
        for left in export.left(out).map_err(|e| system(&e))? {
            eprintln!(
                "rcdeploy: note: {} is of an earlier export; remove it",
                left.display()
            );
        }
    }
    for step in steps.iter().filter(|step| step.change != Change::Keep) {
        let path = out.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
    }
    Ok(0)
}

fn cargo_build(network: &Network, profile: Profile) -> Result<(), Failure> {
    for build in network.builds(profile) {
        let build = build?;
        let mut cargo = Process::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        let status = cargo
            .current_dir(&build.root)
            .args(&build.args)
            .status()
            .map_err(|e| system(&format!("cargo cannot be started: {e}")))?;
        if !status.success() {
            return Err(Failure(
                3,
                format!("cargo could not build {}", build.packages.join(", ")),
            ));
        }
    }
    Ok(())
}
