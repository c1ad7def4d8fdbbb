//! The command line, as clap parses it.

use super::arguments::{
    Action, Input, Managed, Named, TopicArguments, engine, format, rate, seconds, since, switch,
};
use super::completion::{
    components, described, events, logs_of, networks, only_topics, operations,
};
use super::debugging::Debugging;
use super::meaning::ConversionOptions;
use super::world::WorldAction;
use super::{bag, bench, chains, foxglove, play, record, replay, transport};
use clap::{ArgAction, Parser, Subcommand};
use rc_command_line::{Common, files, words};
use rc_deploy_client::{Format, Level};
use rc_deploy_export::Engine;
use rc_deploy_graph::GraphFormat;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::SystemTime;

/// Checks, starts and supervises networks of components.
#[derive(Parser)]
#[command(name = "rcdeploy", version)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Subcommand)]
pub(super) enum Command {
    /// Checks a network and everything that it names. Starts nothing.
    Check {
        #[command(flatten)]
        input: Input,
        /// The form of the findings: human, short or json (one object a line).
        #[arg(long, default_value = "human", value_parser = |text: &str| text.parse::<rc_diagnostics::Format>(), add = words(&["human", "short", "json"]))]
        format: rc_diagnostics::Format,
    },
    /// Examines this machine, and the other machines of a network: what keeps networks from running,
    /// and what to do about it. Changes nothing.
    ///
    /// The exit code is 1 if a problem keeps every network from running.
    Doctor {
        /// A network whose hosts are examined, too, over ssh.
        #[arg(value_name = "FILE.ddsl", add = files(&["ddsl"]))]
        file: Option<PathBuf>,
        /// Searches this folder for imported files, too.
        #[arg(short = 'I', value_name = "DIR")]
        include: Vec<PathBuf>,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Shows the plan of `up`: order, hosts, files, connections, policies. Starts nothing.
    Plan {
        #[command(flatten)]
        input: Input,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
        /// Checks the descriptions only, not generated code, executables and this machine.
        #[arg(long)]
        unbuilt: bool,
    },
    /// Draws a network: components, groups, hosts and connections. Errors are red.
    ///
    /// The picture is written even if the check finds errors. The exit code is then 1.
    Graph {
        #[command(flatten)]
        input: Input,
        /// The form of the picture: svg, mermaid, dot or json (one document).
        #[arg(long, default_value = "svg", value_parser = |text: &str| text.parse::<GraphFormat>(), add = words(&["svg", "mermaid", "dot", "json"]))]
        format: GraphFormat,
        /// Writes to this file instead of standard output.
        #[arg(short, long, value_name = "FILE")]
        output: Option<PathBuf>,
        /// Checks the descriptions only, not generated code, executables and this machine.
        #[arg(long)]
        unbuilt: bool,
        /// Shows the states of the components of the running network, and the active states of
        /// their machines. The network may be named instead of its file; if only one runs, that is
        /// optional.
        #[arg(long)]
        live: bool,
        /// Draws the world that the components share beside them, as `rcdeploy world graph` does, in a picture of the form
        /// svg.
        #[arg(long, requires = "live")]
        world: bool,
    },
    /// Checks a network, starts it, and supervises it until Ctrl-C.
    Up {
        #[command(flatten)]
        input: Input,
        /// Builds the components with cargo first.
        ///
        /// If the generated/ of a component is for another middleware than the network's, a variant
        /// is built below target/rc. The folder of the component is not changed.
        /// Components whose generated code is missing or of an older model are generated before.
        #[arg(long)]
        build: bool,
        /// Refuses missing or stale generated code instead of generating it.
        #[arg(long, requires = "build")]
        no_generate: bool,
        /// Supervises in the background. `rcdeploy down` stops the network.
        #[arg(long)]
        detach: bool,
        #[command(flatten)]
        debugging: Debugging,
        /// Prints events as lines instead of the live view of a terminal.
        #[arg(long)]
        plain: bool,
        /// The form of the events: human or json (one object a line).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
        /// The limit of a log in MiB. A longer log moves to NAME.log.1 and replaces the older part
        /// there.
        #[arg(long, value_name = "MIB", default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
        log_limit: u64,
        #[arg(long, hide = true)]
        supervisor: bool,
    },
    /// Shows a running network live: states, load, rates, events, logs, parameters and connections.
    ///
    /// The network continues to run when you leave the view.
    Top {
        /// The network or its .ddsl. Optional if only one network is up.
        #[arg(add = networks())]
        network: Option<String>,
    },
    /// Stops a running network.
    Down {
        /// The network or its .ddsl. Optional if only one network is up.
        #[arg(add = networks())]
        network: Option<String>,
    },
    /// Shows the state of a running network.
    ///
    /// Components that were started by hand are marked.
    Status {
        /// The network or its .ddsl. Optional if only one network is up.
        #[arg(add = networks())]
        network: Option<String>,
        /// Shows the last start instead, also of a network that has ended: its critical chain, which
        /// is the component that was ready last, the one that it waited for, and so on.
        #[arg(long)]
        start: bool,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Shows the times of the chains of a running network or of a recording, by hops, and lost
    /// messages.
    Chains(chains::Chains),
    /// Measures how long messages need over each connection of a running network, from sending to the
    /// handler, and shows the difference to the last run.
    ///
    /// Components on chains are followed by the supervisor alone: their connections are those of
    /// `rcdeploy chains`. The file `bench.json` beside the logs has the last run.
    Bench(bench::Bench),
    /// Measures how long messages need from one process to another one of this machine. The worst
    /// cases of chains count with the longest of these times from then on.
    Transport(transport::Transport),
    /// Prints the logs of components.
    ///
    /// A line without a time and a level, such as one that the worker prints, belongs to the message
    /// before it.
    Logs {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The component. Without it, the logs of all components.
        #[arg(add = logs_of())]
        component: Option<String>,
        /// Follows the logs until Ctrl-C.
        #[arg(short, long)]
        follow: bool,
        /// How many lines at the end of each log are printed first. Default: 100, and all with
        /// --grep, --since or --level.
        #[arg(short = 'n', long)]
        lines: Option<usize>,
        /// Prints only lines with this text. A text without capital letters matches capital
        /// letters, too. May be given several times.
        #[arg(long, value_name = "TEXT")]
        grep: Vec<String>,
        /// Prints only messages that are not older: `10min` or `2h`, or a time of the log, as in
        /// `2026-01-31T12:00:00Z`.
        #[arg(long, value_name = "TIME", value_parser = since)]
        since: Option<SystemTime>,
        /// Prints only messages of this level, and more important ones: error, warn, info, debug or
        /// trace. A panic has the level error.
        #[arg(long, value_parser = |text: &str| text.parse::<Level>(), add = words(Level::WORDS.map(|(word, _)| word)))]
        level: Option<Level>,
        /// The form of the output: human or json (one object a line).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Starts components that do not run, in the order of their needs, and waits until they are
    /// ready.
    Start(Named),
    /// Stops components, dependents first. They stay stopped until `start`.
    ///
    /// Components that need them continue to run, and get errors.
    Stop(Named),
    /// Stops components, then starts them again.
    Restart(Named),
    /// Configures managed components that are unconfigured, and waits until they are inactive.
    ///
    /// The commands of the life cycle work also for components that were not started by rcdeploy.
    Configure(Managed),
    /// Activates managed components, providers first. It configures them before where needed.
    Activate(Managed),
    /// Deactivates managed components, dependents first. Their calls are refused and their topics
    /// silent until `activate`.
    Deactivate(Managed),
    /// Brings managed components back to unconfigured, dependents first.
    Cleanup(Managed),
    /// Puts a component into its emergency state, or ends this state.
    ///
    /// This works also for components that were not started by rcdeploy.
    Emergency {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The component.
        #[arg(add = components())]
        name: String,
        /// on or off.
        #[arg(action = ArgAction::Set, value_parser = switch, add = words(&["on", "off"]))]
        active: bool,
    },
    /// Fires an event of a component's state machine, and shows the active states afterwards.
    ///
    /// The `.cdsl` of the component lists the events that may be fired in this way: `statemachine
    /// "FILE" { external go, stop; }`. This also works for components that were started by hand.
    Fire {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The component.
        #[arg(add = components())]
        name: String,
        /// The event.
        #[arg(add = events())]
        event: String,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Shows, changes and saves the parameters of running components.
    ///
    /// `params NETWORK NAME` shows the parameters of a component, `params NETWORK` those of all. This works also for components that were not
    /// started by rcdeploy.
    #[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
    Params {
        #[command(subcommand)]
        action: Option<Action>,
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(required = true, add = networks())]
        network: Option<String>,
        /// The component. Without it, the parameters of all components.
        #[arg(add = components())]
        name: Option<String>,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Lists the topics and services of a running network, their ends and their rates.
    ///
    /// A rate is that of all messages of the slot, measured over one second.
    List {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Shows a type, an interface, a slot or an operation of a running network.
    Show {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// Its name, or any end of it that means one thing.
        #[arg(add = described())]
        name: String,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Shows the shared world of a running network, changes it, and asks it.
    ///
    /// `world NETWORK` shows the replicas: their contents, how late each is, whether all are equal,
    /// and what they send. It listens for two and a half seconds. No component counts this command
    /// as a replica.
    #[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
    World {
        #[command(subcommand)]
        action: Option<WorldAction>,
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(required = true, add = networks())]
        network: Option<String>,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Prints the messages of a topic, or the calls of an operation.
    Echo {
        #[command(flatten)]
        watched: TopicArguments,
        /// Prints only this member, as in `pose.x` or `points[3]`. May be given several times.
        #[arg(long, value_name = "PATH")]
        field: Vec<String>,
        /// Ends after this many messages.
        #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
        count: Option<u64>,
        /// Ends after one message.
        #[arg(long, conflicts_with = "count")]
        once: bool,
        /// Prints at most this many messages a second.
        #[arg(long, value_name = "HZ", value_parser = rate)]
        rate: Option<f64>,
        /// Prints lines of CSV. The first line names the columns.
        #[arg(long, conflicts_with = "format")]
        csv: bool,
        #[command(flatten)]
        meaning: ConversionOptions,
    },
    /// Measures the rate of a topic or of calls, and the times between messages. Prints a line each
    /// second.
    Hz {
        #[command(flatten)]
        watched: TopicArguments,
        /// Ends after this many lines.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
        lines: Option<u64>,
    },
    /// Measures the bytes of a topic or of calls. Prints a line each second.
    Bw {
        #[command(flatten)]
        watched: TopicArguments,
        /// Ends after this many lines.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
        lines: Option<u64>,
    },
    /// Measures the time from sending to receiving. Prints a line each second.
    ///
    /// If the senders run on another machine, the command estimates how far its clock is ahead, and
    /// prints the greatest error of the estimate. Over shared memory a tool looks for samples each
    /// millisecond, which the delay includes.
    Delay {
        #[command(flatten)]
        watched: TopicArguments,
        /// Ends after this many lines.
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
        lines: Option<u64>,
    },
    /// Calls an operation of a component. An exception is printed, and the exit code is 1.
    ///
    /// The component handles the call as if it came from a client. So this works over every
    /// middleware and on every machine of the network.
    Call {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// COMPONENT.SLOT.OPERATION, or any end of it that means one thing.
        #[arg(value_name = "OPERATION", add = operations())]
        operation: String,
        /// The parameters as a JSON object. Missing ones have their default values.
        #[arg(value_name = "JSON", default_value = "{}")]
        parameters: String,
        /// How long the reply may take, in seconds.
        #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
        timeout: f64,
        /// The form of the output: human or json (one document).
        #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
        format: Format,
    },
    /// Sends a sample to a topic: once, or again and again with `--rate`.
    Send {
        /// The network or its .ddsl. Optional if only one network runs.
        #[arg(add = networks())]
        network: String,
        /// COMPONENT.SLOT.OPERATION of one of its ends, its address, or any end of these that means
        /// one thing.
        #[arg(value_name = "TOPIC", add = only_topics())]
        topic: String,
        /// The sample as a JSON object. Missing members have their default values.
        #[arg(value_name = "JSON", default_value = "{}")]
        value: String,
        /// Sends this many samples a second, until Ctrl-C or `--count`.
        #[arg(long, value_name = "HZ", value_parser = rate)]
        rate: Option<f64>,
        /// Sends this many samples.
        #[arg(long, value_name = "N", requires = "rate", value_parser = clap::value_parser!(u64).range(1..))]
        count: Option<u64>,
    },
    /// Exports a network to another orchestrator: same programs, order, limits and policies.
    ///
    /// Unsupported features are reported, and noted in the files.
    Export {
        #[command(flatten)]
        input: Input,
        /// The orchestrator: systemd (units), compose (files for `docker compose`) or kubernetes
        /// (manifests).
        #[arg(long, value_name = "ENGINE", value_parser = engine, add = words(&["systemd", "compose", "kubernetes"]))]
        to: Engine,
        /// The output folder.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// The container image, for compose (default: debian:stable-slim) and kubernetes.
        #[arg(long)]
        image: Option<String>,
        /// Lists the files without writing them.
        #[arg(long)]
        dry_run: bool,
    },
    /// Lets systemd run a network: from the boot on, again after a failure, with its log in the
    /// journal.
    ///
    /// Writes a unit that runs `rcdeploy up` with these arguments, enables and starts it, and lets
    /// the user linger, so that a logout removes nothing. `systemctl --user stop robocomp-NETWORK`
    /// and `rcdeploy down` stop it.
    InstallService {
        #[command(flatten)]
        input: Input,
        /// Writes a unit of the system, which runs as the owner of the file (of a link: of its
        /// target). It needs root.
        #[arg(long)]
        system: bool,
        /// Enables the unit, and does not start it.
        #[arg(long)]
        no_start: bool,
        /// Stops the network, and removes its unit.
        #[arg(long, conflicts_with_all = ["no_start", "dry_run"])]
        remove: bool,
        /// Prints the unit, and changes nothing.
        #[arg(long)]
        dry_run: bool,
    },
    /// Records a running network as MCAP: topics, calls, events, parameters and states.
    ///
    /// Ctrl-C ends the recording.
    Record(record::Record),
    /// Sends recorded samples of topics, and recorded answers to calls that no component answers.
    ///
    /// In a terminal, the space bar pauses, `s` sends the next message, the arrow keys go back and
    /// forth, and `q` ends.
    Play(play::Play),
    /// Looks into recordings, and takes parts of them.
    #[command(subcommand)]
    Bag(bag::Bag),
    /// Lets a component live again by its exact recording, and compares all that it sends.
    ///
    /// The component runs alone, without a network, as fast as it can. The exit code is 1 if it
    /// does something else than it did.
    Replay(replay::Replay),
    /// Serves a running network to Foxglove until Ctrl-C: topics, calls, parameters, and who is
    /// connected.
    ///
    /// Open the printed address in Foxglove as a Foxglove WebSocket. This starts the program
    /// `rcfoxglove`.
    Foxglove(foxglove::Foxglove),
    #[command(flatten)]
    Common(Common),
    /// Waits for gdb at a socket, then is the gdbserver of a program. Started by `up --debug`.
    #[command(hide = true)]
    Gdbserver {
        socket: PathBuf,
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, required = true)]
        command: Vec<OsString>,
    },
    /// Runs components for a supervisor on another machine. Started by `up`, over ssh.
    #[command(hide = true)]
    Agent,
    /// Cleans up when the supervisor is killed. Started by `up`.
    #[command(hide = true)]
    Guard {
        #[arg(long)]
        network: String,
    },
}
