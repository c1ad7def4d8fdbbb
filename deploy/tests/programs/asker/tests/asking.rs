//! Components that ask each other at the same time, over shared memory and over DDS, and do not
//! wait: with calls that wait, both would time out.

use asker_generated::{
    Call, CallId, Context, Embedded, Far, FarOtherDone, FarSlot, GetBatteryStateError, Near,
    OtherDone, TBattery, Worker, WorkerError, embed,
};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Condvar, Mutex};
use std::time::Duration;

/// How many calls of a slot are in flight.
const AT_ONCE: usize = 3;
/// Longer than any reply takes.
const LIMIT: Duration = Duration::from_secs(20);
/// The limit of a call that is not answered.
const SHORT: Duration = Duration::from_millis(100);

/// The results of a component: the slot, and the level or the error.
type Ended = (&'static str, Result<f32, String>);

/// Where the components of this name report.
static REPORTS: Mutex<BTreeMap<String, Sender<Ended>>> = Mutex::new(BTreeMap::new());

/// Whether the component `mute` may answer.
static MAY_ANSWER: (Mutex<bool>, Condvar) = (Mutex::new(false), Condvar::new());

fn report(ctx: &Context, slot: &'static str, result: Result<TBattery, GetBatteryStateError>) {
    let level = result.map(|battery| battery.percentage);
    let ended = (slot, level.map_err(|error| error.to_string()));
    let reports = REPORTS.lock().expect("no panic");
    reports[ctx.name()].send(ended).expect("a test that waits");
}

#[derive(Default)]
struct Asker {
    near: BTreeMap<CallId, Call<TBattery, GetBatteryStateError>>,
    far: Vec<Call<TBattery, GetBatteryStateError>>,
    near_started: i32,
    far_started: i32,
}

impl Worker<Context> for Asker {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        if ctx.name() == "hasty" {
            ctx.other.set_timeout(SHORT);
            ctx.far_other.set_timeout(SHORT);
        }
        Ok(Self::default())
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let calls = std::mem::take(&mut self.far);
        for call in calls {
            match ctx.far_other.take(&call) {
                Some(result) => report(ctx, "far", result),
                None => self.far.push(call),
            }
        }
        if !ctx.other.is_connected() || !ctx.far_other.is_connected() {
            return Ok(());
        }
        let rounds = ctx.params.rounds;
        while self.near.len() < AT_ONCE && self.near_started < rounds {
            let call = ctx.other.start_get_battery_state()?;
            self.near.insert(call.id(), call);
            self.near_started += 1;
        }
        while self.far.len() < AT_ONCE && self.far_started < rounds {
            self.far.push(ctx.far_other.start_get_battery_state()?);
            self.far_started += 1;
        }
        Ok(())
    }
}

impl OtherDone for Asker {
    fn get_battery_state_done(
        &mut self,
        ctx: &mut Context,
        call: CallId,
        result: Result<TBattery, GetBatteryStateError>,
    ) {
        assert!(
            self.near.remove(&call).is_some(),
            "a call that ended before"
        );
        report(ctx, "near", result);
    }
}

impl FarOtherDone for Asker {}

fn answer(ctx: &Context) -> TBattery {
    if ctx.name() == "mute" {
        let (may_answer, changed) = &MAY_ANSWER;
        let guard = may_answer.lock().expect("no panic");
        drop(changed.wait_while(guard, |may_answer| !*may_answer));
    }
    TBattery {
        percentage: ctx.params.level,
        ..TBattery::default()
    }
}

impl Near<Context> for Asker {
    fn get_battery_state(&mut self, ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        Ok(answer(ctx))
    }
}

impl Far<Context, FarSlot> for Asker {
    fn get_battery_state(&mut self, ctx: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        Ok(answer(ctx))
    }
}

/// Starts a component that asks another one.
fn start(
    network: [&str; 2],
    name: &str,
    other: &str,
    more: [&str; 2],
) -> (Embedded, Receiver<Ended>) {
    let (to, reports) = channel();
    let mut all = REPORTS.lock().expect("no panic");
    all.insert(name.to_owned(), to);
    drop(all);
    let [network, domain] = network;
    let settings = [
        format!("dds.domain={domain}"),
        "dds.interfaces=lo".to_owned(),
    ];
    let bindings = [
        ("near", name, "near"),
        ("far", name, "far"),
        ("other", other, "near"),
        ("far_other", other, "far"),
    ];
    let bindings = bindings.map(|(slot, of, end)| format!("{slot}={of}/{end}"));
    let mut args = vec!["--network", network, "--name", name];
    for (option, values) in [
        ("--set-middleware", &settings[..]),
        ("--bind", &bindings[..]),
    ] {
        args.extend(values.iter().flat_map(|value| [option, value.as_str()]));
    }
    args.extend(more.iter().flat_map(|value| ["--set", value]));
    (embed::<Asker>(&args).expect("a component"), reports)
}

/// The reports of a component, by slot.
fn collect(
    reports: &Receiver<Ended>,
    count: usize,
) -> BTreeMap<&'static str, Vec<Result<f32, String>>> {
    let mut all = BTreeMap::<_, Vec<_>>::new();
    for _ in 0..count {
        let (slot, result) = reports.recv_timeout(LIMIT).expect("a call that ends");
        all.entry(slot).or_default().push(result);
    }
    all
}

#[test]
fn two_components_ask_each_other() {
    let network = ["asker-two", "226"];
    let (left, of_left) = start(network, "left", "right", ["level=10.0", "rounds=20"]);
    let (right, of_right) = start(network, "right", "left", ["level=20.0", "rounds=20"]);
    for (reports, level) in [(&of_left, 20.0), (&of_right, 10.0)] {
        let all = collect(reports, 40);
        for slot in ["near", "far"] {
            assert_eq!(all[slot], vec![Ok(level); 20], "{slot}");
        }
    }
    for component in [left, right] {
        component.stop();
        component.join().expect("an end in order");
    }
    // Each call ended once.
    assert!(of_left.try_recv().is_err() && of_right.try_recv().is_err());
}

/// The other one is in a handler for longer than the calls may take.
#[test]
fn calls_without_a_reply_end_while_their_component_goes_on() {
    let network = ["asker-mute", "227"];
    let (mute, _of_mute) = start(network, "mute", "nobody", ["level=1.0", "rounds=0"]);
    let (hasty, of_hasty) = start(network, "hasty", "mute", ["level=1.0", "rounds=6"]);
    let all = collect(&of_hasty, 12);
    for slot in ["near", "far"] {
        let late = format!("no reply from `mute/{slot}` within {SHORT:?}");
        assert_eq!(all[slot], vec![Err(late); 6], "{slot}");
    }
    let (may_answer, changed) = &MAY_ANSWER;
    *may_answer.lock().expect("no panic") = true;
    changed.notify_all();
    for component in [hasty, mute] {
        component.stop();
        component.join().expect("an end in order");
    }
    assert!(of_hasty.try_recv().is_err(), "a call has ended twice");
}
