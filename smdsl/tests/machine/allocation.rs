//! No step allocates memory.

use crate::loading::{chart, model};
use rc_machine::{Failed, Host, Interpreter, Session};
use std::time::Duration;

/// All that a step may do: regions, history, delays, raised events, errors, conflicts.
const CHART: &str = r#"<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="on">
  <parallel id="on">
    <transition event="reset" target="on"/>
    <state id="a" initial="a1">
      <history id="last" type="deep"><transition target="a1"/></history>
      <state id="a1">
        <onentry><send event="late" delay="3s" id="d"/><raise event="inner"/></onentry>
        <transition event="next inner.x" target="a2"><script>works</script></transition>
      </state>
      <state id="a2" initial="a22">
        <onentry><cancel sendid="d"/><log label="a2" expr="'x'"/></onentry>
        <onexit><script>fails</script></onexit>
        <state id="a21"><transition event="next" target="a1"/></state>
        <state id="a22"><transition event="late" target="a21"/><transition event="next" target="a21"/></state>
        <transition event="error.execution" target="b2"/>
      </state>
    </state>
    <state id="b">
      <state id="b1"><transition event="next" cond="odd" target="b2"/><transition cond="In('a21')" target="b3"/></state>
      <state id="b2"><transition event="back" target="last"/><transition event="*" target="b1"/></state>
      <final id="b3"/>
      <transition event="done.state.b" target="b1"/>
    </state>
  </parallel>
</scxml>"#;

struct Quiet {
    session: Session,
    time: Duration,
    asked: u32,
    entries: u64,
}

impl Host for Quiet {
    fn session(&mut self) -> &mut Session {
        &mut self.session
    }

    fn now(&mut self) -> Duration {
        self.time
    }

    fn guard(&mut self, _: u16) -> bool {
        self.asked += 1;
        self.asked % 2 == 1
    }

    fn call(&mut self, function: u16) -> Result<(), Failed> {
        if function == 0 { Ok(()) } else { Err(Failed) }
    }

    fn enter(&mut self, _: u16) -> Result<(), Failed> {
        self.entries += 1;
        Ok(())
    }

    fn exit(&mut self, _: u16) -> Result<(), Failed> {
        Ok(())
    }

    fn log(&mut self, _: &str, _: &str) {}
}

#[test]
fn a_step_allocates_nothing() {
    let chart = chart(&model("chart.scxml", CHART));
    let mut interpreter = Interpreter::new(chart);
    let mut host = Quiet {
        session: Session::new(chart),
        time: Duration::ZERO,
        asked: 0,
        entries: 0,
    };
    let counted = allocation_counter::measure(|| {
        interpreter.start(&mut host).expect("a start");
        let mut random = 1_u64;
        for _ in 0..10_000 {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            host.time += Duration::from_millis(random >> 54);
            let event = (random >> 33) as u16 % chart.fireable;
            host.session.fire(event).expect("room");
            while interpreter.step(&mut host).expect("a step").is_some() {}
            interpreter.rest(&mut host).expect("rest");
        }
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(host.entries > 10_000, "{}", host.entries);
}
