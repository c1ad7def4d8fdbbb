//! Many deaths at once: half of a network is killed together. Measures until all run again, whether
//! every start succeeds, and how long `status` takes meanwhile.

use super::{LIMIT, Place, Starter};
use crate::pair::quantile;
use crate::programs::{END, Failure, LOOK, Running};
use rc_deploy_network::Profile;
use rc_management::{Client, supervisor};
use rc_middleware::RunDirectory;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader};
use std::process::Stdio;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// How often `status` is asked before the kill.
const ASKED: usize = 21;
/// How long an answer may take at most.
const ANSWER: Duration = Duration::from_secs(30);
/// The goals: so many times the first start of as many, and so many times the time of an answer
/// before.
const STARTS: u32 = 3;
const ANSWERS: u32 = 10;
/// Time that `status` may always take: the scheduler of a busy machine.
const NOISE: Duration = Duration::from_millis(50);

/// Events that a kill must not lead to.
const FAILURES: [&str; 5] = [
    "start-failed",
    "not-ready",
    "gave-up",
    "refused",
    "not-killed",
];

/// Text for a goal that is missed.
pub(super) const MISSED: &str = "components that were killed together recover too slowly";

/// Kills `killed` of `count` components at once, and prints a row. `first` is the time of the first
/// start of a network of `killed` components. Returns whether the goals are met; a failed start is
/// an error.
pub(super) fn run(
    count: usize,
    killed: usize,
    profile: Profile,
    first: Duration,
) -> Result<bool, Failure> {
    let mut place = Place::new(count, profile, None)?;
    // An unoptimised component on a busy machine needs more time than the usual ten seconds.
    let ready = if profile == Profile::Dev {
        "ready 60s; "
    } else {
        ""
    };
    place.fields = format!("restart on_failure; {ready}");
    let mut command = place.command(Starter::Rcdeploy)?;
    command.stdout(Stdio::piped());
    let mut up = Running(command.spawn()?);
    let events = events(&mut up)?;
    await_event(&events, "up")?;
    let socket = RunDirectory::below(&place.path("run/robocomp"), "bench").socket("rcdeploy");
    let mut asked = Vec::new();
    let mut before = Value::Null;
    for _ in 0..ASKED {
        let (status, took) = status(&socket)?;
        asked.push(took);
        before = status;
    }
    let idle = quantile(&mut asked, 0.5);
    let pids: Vec<Option<Pid>> = processes(&before).take(killed).collect();
    let start = Instant::now();
    for pid in &pids {
        kill_process(pid.ok_or("a component without a process")?, Signal::KILL)?;
    }
    let (mut longest, mut answers) = (Duration::ZERO, 0);
    let took = loop {
        let (now, took) = status(&socket)?;
        longest = longest.max(took);
        answers += 1;
        let ready = |component: &Value| component["ready"] == true;
        let all = components(&now).all(ready);
        let anew = processes(&now).zip(&pids).all(|(new, old)| new != *old);
        if all && anew {
            break start.elapsed();
        }
        if start.elapsed() > LIMIT {
            return Err(format!("not all of {killed} run again within {LIMIT:?}: {now}").into());
        }
        std::thread::sleep(LOOK);
    };
    kill_process(Pid::from_child(&up.0), Signal::TERM)?;
    if !up.ended_within(LIMIT.max(END)) {
        return Err("rcdeploy does not end".into());
    }
    let failed = failures(events.iter());
    if let Some(event) = failed.first() {
        let text = format!(
            "{} failed starts after the kill, first {event}",
            failed.len()
        );
        return Err(text.into());
    }
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    println!(
        "| killed at once | first start of as many, s | all ready again, s | `status` before, ms | longest `status` meanwhile, ms |"
    );
    println!("|---|---|---|---|---|");
    println!(
        "| {killed} of {count} | {:.2} | {:.2} | {:.1} | {:.1} of {answers} |",
        first.as_secs_f64(),
        took.as_secs_f64(),
        ms(idle),
        ms(longest)
    );
    Ok(took < first * STARTS && longest < (idle * ANSWERS).max(NOISE))
}

/// The events of a failed start. Each component ends once, by the kill; one that ends again before
/// the network stops had a useless start.
fn failures(events: impl Iterator<Item = Value>) -> Vec<Value> {
    let mut ended = BTreeSet::new();
    let running = events.take_while(|event| event["code"] != "stopping");
    let mut fails = |event: &Value| {
        let again = event["code"] == "exited" && !ended.insert(event["component"].to_string());
        again || FAILURES.iter().any(|code| event["code"] == *code)
    };
    running.filter(|event| fails(event)).collect()
}

/// The events of rcdeploy, which a thread reads.
fn events(up: &mut Running) -> Result<Receiver<Value>, Failure> {
    let output = BufReader::new(up.0.stdout.take().ok_or("no pipe")?);
    let (sender, events) = channel();
    std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            if let Ok(event) = serde_json::from_str(&line)
                && sender.send(event).is_err()
            {
                return;
            }
        }
    });
    Ok(events)
}

fn await_event(events: &Receiver<Value>, code: &str) -> Result<(), Failure> {
    let end = Instant::now() + LIMIT;
    loop {
        let left = end.saturating_duration_since(Instant::now());
        let event = events.recv_timeout(left);
        if event.map_err(|_| format!("no event `{code}`"))?["code"] == code {
            return Ok(());
        }
    }
}

/// One `status`, over a connection of its own, as the command makes it.
fn status(socket: &std::path::Path) -> Result<(Value, Duration), Failure> {
    let start = Instant::now();
    let mut client = Client::connect(socket, ANSWER)?;
    let status = client.call(&supervisor::Request::Status, ANSWER)?;
    Ok((status, start.elapsed()))
}

fn components(status: &Value) -> impl Iterator<Item = &Value> {
    status["components"].as_array().into_iter().flatten()
}

fn processes(status: &Value) -> impl Iterator<Item = Option<Pid>> {
    components(status).map(|component| {
        let pid = component["pid"].as_i64()?;
        Pid::from_raw(pid.try_into().ok()?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_component_that_ends_again_before_it_is_ready_is_a_failed_start() {
        let event = |component: &str, code: &str| json!({"component": component, "code": code});
        let [killed, ready] = ["exited", "ready"].map(|code| event("c1", code));
        let other = event("c2", "exited");
        let stopping = json!({"component": null, "code": "stopping"});
        let good = [&killed, &other, &ready, &stopping, &killed].map(Value::clone);
        assert_eq!(failures(good.into_iter()), Vec::<Value>::new());
        let bad = [&killed, &other, &killed, &ready].map(Value::clone);
        assert_eq!(failures(bad.into_iter()), [killed]);
        let late = event("c2", "not-ready");
        assert_eq!(failures([other, late.clone()].into_iter()), [late]);
    }
}
