//! A world compared with topics with the same bytes, each component in a process of its own, over
//! shared memory and, in one row, over DDS. Without arguments, it runs everything and prints a
//! table; with a role, it is one process.

mod linked;
mod member;

use member::{Done, Mode, Role};
use std::process::{Child, Command, ExitCode, Stdio};

/// A comparison: `name`, the roles of the processes, and the goal of world over topic.
struct Row {
    name: &'static str,
    middleware: &'static str,
    roles: Vec<Role>,
    /// How often the processes run.
    runs: usize,
    of: fn(&[Done]) -> f64,
    unit: &'static str,
    goal: f64,
}

const SHARED: &str = "iceoryx2";
/// The domain of DDS.
const DOMAIN: u32 = 194;

/// The median time from the write to the handler.
fn delay(all: &[Done]) -> f64 {
    let delays = all.iter().filter(|done| done.count > 0);
    let delays: Vec<f64> = delays.map(|done| done.median_us).collect();
    delays.iter().sum::<f64>() / delays.len().max(1) as f64
}

/// The processor time of all processes, in milliseconds a second.
fn processor(all: &[Done]) -> f64 {
    all.iter().map(|done| done.processor).sum()
}

/// What a component gets that has just started, which happens once: the median of several starts.
fn joining(all: &[Done]) -> f64 {
    let firsts = all.iter().filter(|done| done.count > 0);
    let mut firsts: Vec<f64> = firsts.map(|done| done.first_us).collect();
    firsts.sort_unstable_by(f64::total_cmp);
    firsts.get(firsts.len() / 2).copied().unwrap_or(f64::NAN)
}

fn rows(seconds: u64) -> Vec<Row> {
    let role = |rate, receives, stream, nodes| Role {
        mode: Mode::World,
        rate,
        receives,
        stream,
        nodes,
        late: false,
        seconds,
    };
    let stream: Vec<Role> = std::iter::once(role(1000, false, true, 1))
        .chain((0..10).map(|_| role(0, true, true, 1)))
        .collect();
    vec![
        Row {
            name: "a change, write to handler in another process",
            middleware: SHARED,
            roles: vec![role(200, false, false, 1), role(0, true, false, 1)],
            runs: 1,
            of: delay,
            unit: "µs",
            goal: 1.3,
        },
        Row {
            name: "the same over DDS",
            middleware: "dds",
            roles: vec![role(200, false, false, 1), role(0, true, false, 1)],
            runs: 1,
            of: delay,
            unit: "µs",
            goal: 1.3,
        },
        Row {
            name: "ten agents of 100 changes a second, processor",
            middleware: SHARED,
            roles: (0..10).map(|_| role(100, true, false, 1)).collect(),
            runs: 1,
            of: processor,
            unit: "ms/s",
            goal: 2.0,
        },
        Row {
            name: "a stream of 1 kHz with ten readers, processor",
            middleware: SHARED,
            roles: stream,
            runs: 1,
            of: processor,
            unit: "ms/s",
            goal: 1.1,
        },
        Row {
            name: "a late joiner gets 1,000 nodes, from its question on; a new subscriber gets them as a sample",
            middleware: SHARED,
            roles: [false, true]
                .map(|late| Role {
                    late,
                    seconds: 1,
                    ..role(0, late, false, 1000)
                })
                .to_vec(),
            runs: if seconds > 1 { 9 } else { 1 },
            of: joining,
            unit: "µs",
            goal: 2.0,
        },
    ]
}

fn start(role: &Role, middleware: &str, network: &str, number: usize) -> Result<Child, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let mut command = Command::new(program);
    command.args(["--network", network, "--name", &format!("agent{number}")]);
    for slot in ["g", "g_stream", "g_peers", "g_streams"] {
        command.args(["--transport", &format!("{slot}={middleware}")]);
    }
    if middleware != SHARED {
        command.args(["--set-middleware", &format!("dds.domain={DOMAIN}")]);
    }
    command.env(member::ROLE_OF, role.text());
    let command = command.stdout(Stdio::piped()).stdin(Stdio::null());
    command.spawn().map_err(|error| error.to_string())
}

/// Runs processes in parallel, and returns their measurements.
fn run(roles: &[Role], middleware: &str, network: &str) -> Result<Vec<Done>, String> {
    let mut children = Vec::new();
    for (number, role) in roles.iter().enumerate() {
        children.push(start(role, middleware, network, number)?);
    }
    let outputs = children.into_iter().map(Child::wait_with_output);
    let outputs: Vec<_> = outputs.collect();
    let read = outputs.into_iter().map(|output| {
        let output = output.map_err(|error| error.to_string())?;
        let text = String::from_utf8_lossy(&output.stdout);
        let last = text.lines().last().unwrap_or_default();
        Done::read(last).ok_or_else(|| format!("a process has measured nothing: {text}"))
    });
    read.collect()
}

fn table(seconds: u64) -> Result<(), String> {
    println!("| | world | topic | ratio | goal |\n|---|---|---|---|---|");
    let network = |word: &str, at: usize| format!("bench-world-{}-{word}{at}", std::process::id());
    for (at, row) in rows(seconds).iter().enumerate() {
        let topic: Vec<Role> = row.roles.iter().map(Role::as_topic).collect();
        let (mut worlds, mut topics) = (Vec::new(), Vec::new());
        for number in 0..row.runs {
            let number = at + 100 * number;
            worlds.extend(run(&row.roles, row.middleware, &network("w", number))?);
            topics.extend(run(&topic, row.middleware, &network("t", number))?);
        }
        let (world, topic) = ((row.of)(&worlds), (row.of)(&topics));
        let (ratio, unit) = (world / topic, row.unit);
        println!(
            "| {} | {world:.1} {unit} | {topic:.1} {unit} | {ratio:.2} | {:.1} |",
            row.name, row.goal
        );
    }
    let idle = |mode| {
        let role = Role {
            mode,
            rate: 0,
            receives: true,
            stream: false,
            nodes: 0,
            late: false,
            seconds,
        };
        let role = if role.mode == Mode::Topic {
            role.as_topic()
        } else {
            role
        };
        run(&[role.clone(), role], SHARED, &network(role_word(mode), 99))
    };
    let (world, topic) = (idle(Mode::World)?, idle(Mode::Topic)?);
    let memory = |all: &[Done]| all.iter().map(|done| done.memory_kb).sum::<f64>() / 2048.0;
    println!(
        "| an idle replica, memory | {:.2} MB | {:.2} MB | + {:.2} MB | + 2 MB |",
        memory(&world),
        memory(&topic),
        memory(&world) - memory(&topic)
    );
    let share = |all: &[Done]| processor(all) / 20.0;
    println!(
        "| an idle replica, a core | {:.3} % | {:.3} % | + {:.3} % | + 0.1 % |",
        share(&world),
        share(&topic),
        share(&world) - share(&topic)
    );
    Ok(())
}

fn role_word(mode: Mode) -> &'static str {
    match mode {
        Mode::World => "w",
        Mode::Topic => "t",
    }
}

fn main() -> ExitCode {
    if let Ok(role) = std::env::var(member::ROLE_OF) {
        return ended(member::run(&role));
    }
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    ended(match args[..] {
        [] => table(10),
        ["--smoke"] => table(1),
        _ => Err("usage: bench_world [--smoke]".to_owned()),
    })
}

fn ended(done: Result<(), String>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
