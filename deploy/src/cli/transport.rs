//! `rcdeploy transport`: how long messages need on this machine, for the worst cases of chains.

use super::output::{Failure, show};
use clap::Args;
use rc_command_line::words;
use rc_deploy_client::{Format, logs};
use rc_management::chains::Times;
use rc_vocabulary::Middleware;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::{File, TryLockError};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime};

/// Arguments of `transport`.
#[derive(Args)]
pub(super) struct Transport {
    /// Measures this middleware only, and keeps what is known of the others: iceoryx2, dds or ros2.
    #[arg(long, value_parser = middleware, add = words(&["iceoryx2", "dds", "ros2"]))]
    middleware: Option<Middleware>,
    /// The messages of each middleware.
    #[arg(long, default_value_t = 5000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    messages: u32,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = super::arguments::format, add = words(&["human", "json"]))]
    format: Format,
    /// The process that receives: prints the times, in nanoseconds.
    #[arg(long, hide = true, requires = "middleware")]
    receive: Option<String>,
}

/// Measurements on this machine: for each middleware, the times of a message.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Table {
    /// The name of the machine. Several machines may share a home folder.
    #[serde(default)]
    machine: String,
    #[serde(default)]
    middlewares: BTreeMap<String, Times>,
}

/// The middlewares that connect processes.
const MEASURED: [Middleware; 3] = [Middleware::Iceoryx2, Middleware::Dds, Middleware::Ros2];

fn middleware(text: &str) -> Result<Middleware, String> {
    let known = Middleware::from_word(text).filter(|known| MEASURED.contains(known));
    known.ok_or_else(|| "expected iceoryx2, dds or ros2".to_owned())
}

/// Where the table is: beside the logs of networks.
fn place() -> PathBuf {
    logs::root().join("transport.json")
}

impl Table {
    /// Nothing is measured yet on this machine.
    fn new() -> Self {
        let name = rustix::system::uname();
        Self {
            machine: name.nodename().to_string_lossy().into_owned(),
            middlewares: BTreeMap::new(),
        }
    }
}

/// The table of this machine; that of another one does not count.
fn read() -> Result<Table, Failure> {
    let path = place();
    let new = Table::new();
    let text = match rc_files::read(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(new),
        Err(error) => return Err(Failure(3, format!("{}: {error}", path.display()))),
    };
    let table = serde_json::from_str(&text);
    let table: Table = table.map_err(|error| {
        let path = path.display();
        let help = "remove it, and measure again with `rcdeploy transport`";
        Failure(3, format!("{path} is damaged: {error}; {help}"))
    })?;
    let is_here = table.machine == new.machine;
    Ok(if is_here { table } else { new })
}

/// The longest time of a message over each middleware that was measured on this machine.
pub(super) fn measured() -> Result<Vec<(Middleware, Duration)>, Failure> {
    let table = read()?.middlewares.into_iter();
    let known = table.filter_map(|(word, times)| {
        let longest = Duration::try_from_secs_f64(times.worst_ms / 1e3).ok()?;
        Some((Middleware::from_word(&word)?, longest))
    });
    Ok(known.collect())
}

pub(super) fn transport(options: &Transport) -> Result<u8, Failure> {
    let messages = options.messages;
    if let (Some(run), Some(middleware)) = (&options.receive, options.middleware) {
        let times = rc_observe::receive_transport(run, middleware.word(), messages)?;
        super::output::print_json(&times)?;
        return Ok(0);
    }
    let path = place();
    let failed = |error: std::io::Error| Failure(3, format!("{}: {error}", path.display()));
    logs::make_folder(&logs::root()).map_err(failed)?;
    // Two at once would slow each other. Some file systems have no locks.
    let folder = File::open(logs::root()).map_err(failed)?;
    if let Err(TryLockError::WouldBlock) = folder.try_lock() {
        let text = "another `rcdeploy transport` is running";
        return Err(Failure(3, text.to_owned()));
    }
    // A damaged file is replaced as a whole.
    let mut table = match options.middleware {
        Some(_) => read()?,
        None => Table::new(),
    };
    let all = MEASURED.into_iter();
    for middleware in all.filter(|one| options.middleware.is_none_or(|only| only == *one)) {
        let times = measure(middleware, messages)?;
        table
            .middlewares
            .insert(middleware.word().to_owned(), times);
    }
    let text = serde_json::to_string_pretty(&table).map_err(std::io::Error::other);
    let text = text.map_err(failed)? + "\n";
    rc_files::write_with(&path, |out| out.write_all(text.as_bytes())).map_err(failed)?;
    show(options.format, &table, ToString::to_string)
}

/// Measures one middleware, between this process and another one.
fn measure(middleware: Middleware, messages: u32) -> Result<Times, Failure> {
    let word = middleware.word();
    let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
    let run = format!("p{}_{}", std::process::id(), since.as_nanos());
    let failed = |error: std::io::Error| Failure(3, format!("start the receiver: {error}"));
    let mut receiver = Command::new(std::env::current_exe().map_err(failed)?);
    receiver
        .args(["transport", "--middleware", word, "--receive", &run])
        .args(["--messages", &messages.to_string()])
        .stdin(Stdio::null())
        .stdout(Stdio::piped());
    let mut receiver = receiver.spawn().map_err(failed)?;
    let sent = rc_observe::send_transport(&run, word, messages);
    if sent.is_err() {
        // It would wait for messages. It may have ended by itself.
        let _ = receiver.kill();
    }
    let output = receiver.wait_with_output().map_err(failed);
    rc_observe::remove_transport();
    sent?;
    let times: Vec<u64> = serde_json::from_slice(&output?.stdout)
        .map_err(|_| Failure(3, format!("the receiver over `{word}` has failed")))?;
    let in_ms = |ns: u64| ns as f64 / 1e6;
    let worst = in_ms(times.iter().copied().max().unwrap_or_default());
    let times = Times::of(times.into_iter().map(in_ms), worst);
    times.ok_or_else(|| Failure(3, format!("no message over `{word}` has arrived")))
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:10}  {:>9}  {:>9}  {:>9}", "", "p50", "p99", "longest")?;
        for (middleware, times) in &self.middlewares {
            let all = [times.p50_ms, times.p99_ms, times.worst_ms];
            let [p50, p99, worst] = all.map(|ms| format!("{ms:.3} ms"));
            writeln!(f, "{middleware:10}  {p50:>9}  {p99:>9}  {worst:>9}")?;
        }
        Ok(())
    }
}
