//! The command line of `rcdeploy`, a module for each command that has much to do.
//! [`TOOL`] lists the exit codes.

mod again;
mod arguments;
mod bag;
mod bench;
mod call;
mod chains;
mod command;
mod completion;
mod control;
mod debugging;
mod description;
mod doctor;
mod export;
mod foxglove;
mod graph;
mod left_out;
mod look;
mod meaning;
mod measure;
mod messages;
mod networks;
mod output;
mod params;
mod play;
mod record;
mod replay;
mod service;
mod top;
mod transport;
mod up;
mod world;

use crate::Options;
use crate::process::background::write_from_background;
use arguments::Input;
use command::{Cli, Command};
use measure::Measure;
use networks::{network_of, running};
use output::{Failure, print_data, print_line, show, system};
use rc_codegen::Files;
use rc_codegen::files::Owner;
use rc_command_line::{Common, Tool};
use rc_deploy_client::{Format, LogFilter, connection, logs, start_report, states, status};
use rc_deploy_network::preview::Preview;
use rc_deploy_terminal::SideView;
use rc_management::lifecycle::Transition;
use rc_management::supervisor::Verb;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

const TOOL: Tool = Tool {
    name: "rcdeploy",
    completion_variable: "RCDEPLOY_COMPLETE",
    exit_codes: &[
        (0, "Success, also if Ctrl-C ends `up`."),
        (1, "The input is wrong, or the request is refused."),
        (2, "The command line is wrong."),
        (
            3,
            "The system refused something, the network is not up, or a component failed.",
        ),
    ],
};

/// How many lines of each log `rcdeploy logs` prints.
const LINES: usize = 100;

/// Runs `rcdeploy` with the arguments of this process.
pub fn main() -> ExitCode {
    let cli = TOOL.parse_edited::<Cli>(|command, words| {
        left_out::with_network(command, words).unwrap_or_else(|failure| output::end(failure))
    });
    output::exit_code(run(cli.command))
}

fn run(command: Command) -> Result<u8, Failure> {
    match command {
        Command::Check { input, format } => description::check(&input, format),
        Command::Doctor {
            file,
            include,
            format,
        } => {
            let input = file.map(|file| Input::of(file, include));
            doctor::doctor(input.as_ref(), format)
        }
        Command::Plan {
            input,
            format,
            unbuilt,
        } => {
            let human = rc_diagnostics::Format::Human;
            let examine = description::examine(&input, unbuilt);
            let network = description::load(&input, human, |network, found| {
                examine(network, found);
                if unbuilt {
                    network.programs.ask_no_cargo();
                    network.programs.check_manifests(input.profile, found);
                }
            })?;
            let preview = Preview::of(&network, input.profile)?;
            show(format, &preview, ToString::to_string)
        }
        Command::Graph {
            input,
            format,
            output,
            unbuilt,
            live,
            world,
        } => graph::graph(input, format, output.as_deref(), unbuilt, live, world),
        Command::Up {
            input,
            build,
            no_generate,
            detach,
            debugging,
            plain,
            format,
            log_limit,
            supervisor,
        } => {
            write_from_background();
            let plain = plain || supervisor || debugging.is_interactive();
            let screen = !plain && format == Format::Human && rc_deploy_terminal::usable();
            let options = Options {
                format,
                relay: !supervisor && !screen,
                view: screen
                    .then_some(|network, covers| Box::new(SideView::start(network, covers))),
                supervisor,
                guard: None,
                log_limit: Some(log_limit << 20),
                memory_pause: None,
                rules: rc_deploy_network::NetworkRules::default(),
                hold: Vec::new(),
                services: BTreeMap::new(),
            };
            let build = build.then_some(if no_generate {
                up::Prepare::AsIs
            } else {
                up::Prepare::Generated
            });
            up::up(&input, build, detach, &debugging, &options)
        }
        Command::Top { network } => top::top(&running(network)?),
        Command::Down { network } => {
            let network = running(network)?;
            // Components have limits of their own; this one is for a supervisor that does not
            // answer.
            connection::down(&network, Duration::from_mins(1))
                .map_err(|error| networks::by_hand_or(&network, error))?;
            Ok(0)
        }
        Command::Status {
            network,
            start: true,
            format,
        } => {
            let chain = start_report::read(&running(network)?)?;
            show(format, &chain, ToString::to_string)
        }
        Command::Status {
            network, format, ..
        } => {
            let report = status::report(&running(network)?)?;
            show(format, &report, status::report_table)
        }
        Command::Chains(options) => chains::chains(options),
        Command::Bench(options) => bench::bench(options),
        Command::Transport(options) => transport::transport(&options),
        Command::Logs {
            network,
            component,
            follow,
            lines,
            grep,
            since,
            level,
            format,
        } => {
            let filter = LogFilter {
                texts: grep,
                since,
                level,
            };
            let shown = logs::Shown {
                lines: lines.or(filter.is_open().then_some(LINES)),
                follow,
                format,
                filter,
            };
            let network = network_of(&network)?;
            let out = &mut rc_diagnostics::print::output();
            logs::print(&network, component.as_deref(), &shown, out)?;
            Ok(0)
        }
        Command::Start(named) => control::control(Verb::Start, &named),
        Command::Stop(named) => control::control(Verb::Stop, &named),
        Command::Restart(named) => control::control(Verb::Restart, &named),
        Command::Configure(managed) => control::lifecycle(Transition::Configure, &managed),
        Command::Activate(managed) => control::lifecycle(Transition::Activate, &managed),
        Command::Deactivate(managed) => control::lifecycle(Transition::Deactivate, &managed),
        Command::Cleanup(managed) => control::lifecycle(Transition::Cleanup, &managed),
        Command::Emergency {
            network,
            name,
            active,
        } => {
            rc_deploy_client::params::emergency(&network_of(&network)?, &name, active)?;
            Ok(0)
        }
        Command::Fire {
            network,
            name,
            event,
            format,
        } => {
            let fired = states::fire(&network_of(&network)?, &name, &event)?;
            show(format, &fired, |fired| {
                format!("{name}: {}\n", fired.states.join(", "))
            })
        }
        Command::Params {
            action: Some(action),
            ..
        } => params::params(action),
        Command::Params {
            network,
            name,
            format,
            ..
        } => {
            let network = network_of(&network.unwrap_or_default())?;
            match name {
                Some(name) => params::of_component(&network, &name, format),
                None => params::of_network(&network, format),
            }
        }
        Command::List { network, format } => look::list(&network, format),
        Command::Show {
            network,
            name,
            format,
        } => look::show(&network, &name, format),
        Command::World {
            action: Some(action),
            ..
        } => world::act(action),
        Command::World {
            network, format, ..
        } => world::world(&network.unwrap_or_default(), format),
        Command::Echo {
            watched,
            field,
            count,
            once,
            rate,
            csv,
            meaning,
        } => messages::echo(
            &watched,
            &messages::Echo {
                fields: field,
                count: count.or(once.then_some(1)),
                rate,
                csv,
                meaning: meaning.converter()?,
            },
        ),
        Command::Hz { watched, lines } => measure::measure(&watched, Measure::Rate, lines),
        Command::Bw { watched, lines } => measure::measure(&watched, Measure::Bandwidth, lines),
        Command::Delay { watched, lines } => measure::measure(&watched, Measure::Delay, lines),
        Command::Call {
            network,
            operation,
            parameters,
            timeout,
            format,
        } => call::call(&network, &operation, &parameters, timeout, format),
        Command::Send {
            network,
            topic,
            value,
            rate,
            count,
        } => call::send(&network, &topic, &value, rate, count),
        Command::Export {
            input,
            to,
            out,
            image,
            dry_run,
        } => export::export(&input, to, &out, image.as_deref(), dry_run),
        Command::InstallService {
            input,
            system,
            no_start,
            remove,
            dry_run,
        } => match (remove, dry_run) {
            (true, _) => service::remove(&input, system),
            (_, true) => service::show(&input, system),
            _ => service::install(&input, system, !no_start),
        },
        Command::Record(options) => record::record(&options),
        Command::Play(options) => play::play(options),
        Command::Bag(command) => bag::bag(command),
        Command::Replay(options) => replay::replay(&options),
        Command::Foxglove(options) => foxglove::foxglove(&options),
        Command::Common(Common::Completions { shell }) => {
            print_data(&TOOL.completion_script(shell));
            Ok(0)
        }
        Command::Common(Common::Man { dir }) => man_pages(&dir),
        Command::Gdbserver { socket, command } => debugging::serve_gdb(&socket, &command),
        Command::Agent => {
            up::agent();
            Ok(0)
        }
        Command::Guard { network } => {
            up::guard(&network);
            Ok(0)
        }
    }
}

fn man_pages(dir: &Path) -> Result<u8, Failure> {
    let mut files = Files::default();
    for page in TOOL.man_pages::<Cli>() {
        files.add(page.file, Owner::Exported, page.text);
    }
    for step in files.write(dir).map_err(|e| system(&e))? {
        let path = dir.join(&step.path);
        print_line(format_args!("{} {}", step.change.word(), path.display()));
    }
    Ok(0)
}
