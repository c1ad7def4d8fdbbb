//! Values that know their age, in one process; run by `tests/compile.rs`.

use aged_generated::{
    BatteryStatus, Collecting, Context, Fresh, FullPoseEuler, GetBatteryStateError, Made, TBattery,
    TData, TLaserData, Worker, WorkerError, embed,
};
use std::sync::Mutex;

/// Notes of the workers.
static SEEN: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn see(what: String) {
    let mut seen = SEEN.lock().expect("the list");
    if !seen.contains(&what) {
        seen.push(what);
    }
}

/// Publishes a scan and a pose in each period, and hears both.
struct Giver {
    periods: usize,
    views: usize,
}

impl Worker<Context> for Giver {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        assert!(ctx.poses.new_full_pose().is_err());
        let battery = TBattery {
            percentage: 7.0,
            ..TBattery::default()
        };
        ctx.battery_status
            .set_get_battery_state(battery)
            .expect("a value that can be sent");
        Ok(Self {
            periods: 0,
            views: 0,
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        self.periods += 1;
        let number = self.periods as f32;
        let echo = TData {
            dist: number,
            ..TData::default()
        };
        ctx.laser_pub.push_laser_data(&[echo])?;
        let pose = FullPoseEuler {
            x: number,
            ..FullPoseEuler::default()
        };
        ctx.sent.new_full_pose(&pose)?;
        if let Ok(first) = ctx.poses.new_full_pose()
            && first.made() == Made::Computed
        {
            let again = ctx.poses.new_full_pose().expect("the same pose");
            assert_eq!(again.made(), Made::Cached);
            assert_eq!(first.value, again.value);
            assert!(first.is_fresh() && first.age() <= again.age());
            let scan = ctx.scans.push_laser_data().expect("a scan");
            let both = again.with(scan);
            see(format!("both are {}", both.made().word()));
        }
        let seen = SEEN.lock().expect("the list").len();
        if self.views > 2 && seen == 3 {
            ctx.stop("done");
        }
        Ok(())
    }
}

impl Collecting for Giver {
    fn view(&mut self, _: &mut Context, scan: Fresh<TLaserData>, pose: Fresh<FullPoseEuler>) {
        assert_eq!(scan.first().map(|echo| echo.dist), Some(pose.x));
        assert!(scan.age() >= pose.age());
        self.views += 1;
    }
}

impl BatteryStatus<Context> for Giver {
    fn get_battery_state(&mut self, _: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        panic!("the last value answers");
    }
}

/// Asks for the battery in each period.
struct Asker;

impl Worker<Context> for Asker {
    fn initialize(_: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self)
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        let Ok(battery) = ctx.other.get_battery_state() else {
            return Ok(());
        };
        let how = ctx.other.freshness().expect("a reply came");
        see(format!("{} is {}", battery.percentage, how.made.word()));
        Ok(())
    }
}

impl Collecting for Asker {
    fn view(&mut self, _: &mut Context, _: Fresh<TLaserData>, _: Fresh<FullPoseEuler>) {}
}

impl BatteryStatus<Context> for Asker {
    fn get_battery_state(&mut self, _: &mut Context) -> Result<TBattery, GetBatteryStateError> {
        Ok(TBattery::default())
    }
}

#[test]
fn values_know_their_age() {
    let network = format!("aged-{}", std::process::id());
    let own = format!("BatteryStatus={network}/own");
    let arguments = ["--network", &network, "--name"];
    let giver = [&arguments[..], &["giver"]].concat();
    let giver = embed::<Giver>(&giver).expect("a component that runs");
    let asker = [&arguments[..], &["asker", "--bind", &own]].concat();
    let asker = embed::<Asker>(&asker).expect("a component that runs");
    giver.join().expect("no panic");
    drop(asker);
    let mut seen = SEEN.lock().expect("the list").clone();
    seen.sort();
    assert_eq!(
        seen,
        ["7 is cached", "7 is computed", "both are partly cached"]
    );
}
