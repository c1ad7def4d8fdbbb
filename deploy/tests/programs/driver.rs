//! A minimal rcdeploy: the commands of the library without the DDSL.
//!
//! Its clean-up writes a line to the file `RC_TEST_CLEANED`. A thread panics as soon as the file
//! `RC_TEST_PANIC` exists. Its guard holds half of its services only when the file `RC_TEST_HOLD`
//! exists, and has cleaned up only when the file `RC_TEST_CLEAN` exists. It creates
//! the file `RC_TEST_LATE` again and again, which the clean-up removes. It misses shared memory when
//! the file `missing` is in the folder of the run directories, and removes that file.

use rc_deploy::{Format, GuardCommand, HoldProgress, HoldTask, Options, Plan, Service, Verb};
use rc_management::lifecycle::Transition;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

fn cleanup() {
    if let Some(late) = std::env::var_os("RC_TEST_LATE") {
        let _ = std::fs::remove_file(late);
        std::thread::sleep(Duration::from_millis(50));
    }
    if let Some(path) = std::env::var_os("RC_TEST_CLEANED") {
        let file = File::options().append(true).create(true).open(path);
        let _ = file.and_then(|mut file| file.write_all(b"cleaned\n"));
    }
}

/// So many services with long names: each component of the plan uses a part of them.
fn services(plan: &Plan, count: usize) -> Vec<Service> {
    let service = |at: usize| Service {
        address: format!("net/{at}/{}", "x".repeat(200)),
        types: "T".to_owned(),
        hash: 1,
        topic: false,
        depth: 0,
        keeps: false,
        users: vec![
            plan.components[at * plan.components.len() / count]
                .name
                .clone(),
        ],
    };
    (0..count).map(service).collect()
}

/// Holds nothing, and reports that it does; the second half only when the file exists.
fn hold(_: &str, tasks: &Receiver<HoldTask>, report: &dyn Fn(HoldProgress)) {
    if let Some(late) = std::env::var_os("RC_TEST_LATE")
        && tasks.recv().is_ok()
    {
        loop {
            let _ = std::fs::write(&late, "");
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    let permit = std::env::var_os("RC_TEST_HOLD").map(PathBuf::from);
    let clean = std::env::var_os("RC_TEST_CLEAN").map(PathBuf::from);
    let missing = std::env::var_os("XDG_RUNTIME_DIR").map(|run| Path::new(&run).join("missing"));
    let mut count = 0;
    loop {
        let task = match tasks.recv_timeout(Duration::from_millis(20)) {
            Ok(task) => task,
            Err(RecvTimeoutError::Timeout) => {
                let missing = missing.as_ref();
                if missing.is_some_and(|file| std::fs::remove_file(file).is_ok()) {
                    report(HoldProgress::Missing(vec!["/dev/shm/a".into()]));
                }
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return,
        };
        count += 1;
        if let HoldTask::CleanUp { deaths } = task {
            while clean.as_ref().is_some_and(|file| !file.exists()) {
                std::thread::sleep(Duration::from_millis(20));
                report(HoldProgress::Cleaning);
            }
            report(HoldProgress::Cleaned(deaths));
            continue;
        }
        while count > 5 && permit.as_ref().is_some_and(|file| !file.exists()) {
            std::thread::sleep(Duration::from_millis(5));
        }
        report(HoldProgress::Held);
    }
}

/// Panics on a separate thread when the file exists.
fn panic_at(path: PathBuf) {
    std::thread::spawn(move || {
        while !path.exists() {
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("a panic was asked for");
    });
}

fn up(arguments: &[String]) -> ExitCode {
    if let Some(path) = std::env::var_os("RC_TEST_PANIC") {
        panic_at(path.into());
    }
    let text = std::fs::read_to_string(&arguments[1]).expect("a plan");
    let plan: Plan = serde_json::from_str(&text).expect("a plan");
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    if has("--detach") {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command.args(["up", &arguments[1], "--supervisor", "--json"]);
        command.args(arguments[2..].iter().filter(|flag| *flag != "--detach"));
        let outcome = rc_deploy::detach(&plan, command);
        if let Some(message) = outcome.message() {
            eprintln!("error: {message}");
        } else {
            let status = rc_deploy::status(&plan.network).expect("it is up");
            print!("{}", rc_deploy_client::status::table(&status));
        }
        return ExitCode::from(outcome.exit_code());
    }
    let own = GuardCommand::own().expect("this program");
    let options = Options {
        format: if has("--json") {
            Format::Json
        } else {
            Format::Human
        },
        relay: has("--relay"),
        view: has("--terminal").then_some(|network, covers| {
            Box::new(rc_deploy_terminal::SideView::start(network, covers))
        }),
        supervisor: has("--supervisor"),
        log_limit: has("--small-logs").then_some(256 * 1024),
        memory_pause: has("--hasty").then_some(Duration::from_millis(20)),
        guard: if has("--no-guard") {
            Some(GuardCommand {
                program: "/bin/false".into(),
                ..own
            })
        } else {
            has("--silent-guard").then(|| GuardCommand {
                program: "/bin/sh".into(),
                args: ["-c", "exec sleep 60", "guard"].map(str::to_owned).into(),
            })
        },
        hold: match arguments.iter().position(|word| word == "--hold") {
            Some(at) => services(&plan, arguments[at + 1].parse().expect("a number")),
            None => Vec::new(),
        },
        ..Options::default()
    };
    ExitCode::from(rc_deploy::up(&plan, &options, &cleanup).exit_code())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize| arguments.get(i).map_or("", String::as_str);
    let done = match argument(0) {
        "up" => {
            rc_deploy::process::background::write_from_background();
            return up(&arguments);
        }
        // `guard --network NETWORK`
        "guard" => {
            let network = arguments.last().map_or("", String::as_str);
            return rc_deploy::guard(network, hold, &cleanup);
        }
        "agent" => return rc_deploy::agent(&|_| cleanup()),
        "status" => rc_deploy::status(argument(1))
            .map(|status| println!("{}", serde_json::to_string(&status).expect("json"))),
        "down" => {
            let limit = argument(2).parse().unwrap_or(20_000);
            rc_deploy::down(argument(1), Duration::from_millis(limit))
        }
        "start" | "stop" | "restart" => {
            let verb = match argument(0) {
                "start" => Verb::Start,
                "stop" => Verb::Stop,
                _ => Verb::Restart,
            };
            rc_deploy_client::connection::command(argument(1), verb, &arguments[2..])
                .map(|result| println!("{}", serde_json::to_string(&result).expect("json")))
        }
        "configure" | "activate" | "deactivate" | "cleanup" => {
            let all = Transition::ALL.into_iter();
            let mut meant = all.filter(|transition| transition.word() == argument(0));
            let transition = meant.next().expect("a transition");
            rc_deploy_client::lifecycle::change(argument(1), transition, &arguments[2..])
                .map(|result| println!("{}", serde_json::to_string(&result).expect("json")))
        }
        "recover" => {
            let directory = rc_middleware::RunDirectory::of(argument(1));
            rc_deploy::recover(&directory, &cleanup).map(|found| println!("{found:?}"))
        }
        "logs" => {
            let component = arguments
                .get(2)
                .map(String::as_str)
                .filter(|a| *a != "--follow");
            let follow = arguments.iter().any(|a| a == "--follow");
            let out = &mut std::io::stdout();
            let shown = rc_deploy_client::logs::Shown {
                lines: Some(10),
                follow,
                format: Format::Human,
                filter: rc_deploy_client::LogFilter::default(),
            };
            rc_deploy_client::logs::print(argument(1), component, &shown, out)
        }
        other => panic!("unknown command {other}"),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
