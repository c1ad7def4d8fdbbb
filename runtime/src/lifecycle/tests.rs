//! Transitions, and their hooks.

use super::*;

fn lifecycle() -> Lifecycle {
    Lifecycle::new(WakeEvent::new().expect("an event"))
}

fn failed(text: &str) -> WorkerError {
    WorkerError::Failed(text.to_owned())
}

#[test]
fn the_gate_is_open_from_activate_to_deactivate() {
    let lifecycle = lifecycle();
    let gate = lifecycle.gate();
    let mut seen = Vec::new();
    let result = lifecycle.go_to(LifecycleState::Active, |hook| {
        seen.push((format!("{hook:?}"), gate.is_open()));
        Ok(())
    });
    assert_eq!(result, Ok(LifecycleState::Active));
    assert!(gate.is_open());
    let result = lifecycle.go_to(LifecycleState::Finalized, |hook| {
        seen.push((format!("{hook:?}"), gate.is_open()));
        Ok(())
    });
    assert_eq!(result, Ok(LifecycleState::Finalized));
    let wanted = [
        ("Configure", false),
        ("Activate", true),
        ("Deactivate", true),
        ("Cleanup", false),
        ("Shutdown", false),
    ];
    let wanted = wanted.map(|(hook, open)| (format!("Transition({hook})"), open));
    assert_eq!(seen, wanted);
}

#[test]
fn a_failure_leads_back_and_an_error_to_error_processing() {
    let lifecycle = lifecycle();
    let missed = lifecycle.take(Transition::Configure, |_| Err(failed("no bus")));
    let missed = missed.expect_err("it fails");
    let text = "configure: no bus; the component is unconfigured now";
    assert_eq!(
        (missed.to_string().as_str(), missed.is_fatal),
        (text, false)
    );

    let mut hooks = Vec::new();
    let missed = lifecycle.take(Transition::Configure, |hook| {
        hooks.push(format!("{hook:?}"));
        match hook {
            Hook::Transition(_) => Err(WorkerError::Emergency("smoke".to_owned())),
            Hook::Error(..) => Ok(()),
        }
    });
    assert_eq!(
        missed.expect_err("it fails").state,
        LifecycleState::Unconfigured
    );
    assert_eq!(hooks[1], "Error(Configure, \"smoke\")");

    let missed = lifecycle.go_to(LifecycleState::Active, |hook| match hook {
        Hook::Transition(Transition::Configure) => Ok(()),
        Hook::Transition(_) => Err(WorkerError::Fatal("fire".to_owned())),
        Hook::Error(..) => Err(failed("no extinguisher")),
    });
    let missed = missed.expect_err("it fails");
    assert_eq!(missed.state, LifecycleState::Finalized);
    assert_eq!(missed.reason, "activate: fire; error: no extinguisher");
    assert!(missed.is_fatal);
    assert!(lifecycle.take(Transition::Configure, |_| Ok(())).is_err());
}

#[test]
fn a_component_that_ends_shuts_down_after_a_hook_that_fails() {
    let lifecycle = lifecycle();
    let run = |_: Hook<'_>| Ok(());
    assert!(lifecycle.go_to(LifecycleState::Active, run).is_ok());
    let mut hooks = Vec::new();
    lifecycle.finish(|hook| {
        hooks.push(format!("{hook:?}"));
        match hook {
            Hook::Transition(Transition::Deactivate) => Err(failed("stuck")),
            _ => Ok(()),
        }
    });
    assert_eq!(hooks, ["Transition(Deactivate)", "Transition(Shutdown)"]);
    assert_eq!(lifecycle.state(), LifecycleState::Finalized);
}

#[test]
fn a_listener_can_ask_for_the_life_cycle() {
    use LifecycleState::{Configuring, Inactive};
    let lifecycle = Arc::new(lifecycle());
    let seen = Arc::new(Mutex::new(Vec::new()));
    let service = Service(Arc::clone(&lifecycle));
    let (of, into) = (Arc::clone(&lifecycle), Arc::clone(&seen));
    service.watch(Arc::new(move |change: LifecycleChange| {
        let report = of.report();
        into.lock()
            .expect("the states")
            .push((change.to, report.state));
    }));
    let run = |_: Hook<'_>| Ok(());
    assert!(lifecycle.take(Transition::Configure, run).is_ok());
    let seen = seen.lock().expect("the states");
    assert_eq!(*seen, [(Configuring, Configuring), (Inactive, Inactive)]);
}

#[test]
fn a_request_that_has_waited_for_its_limit_begins_nothing() {
    let Some(asked) = Instant::now().checked_sub(LIMIT) else {
        return;
    };
    let lifecycle = Arc::new(lifecycle());
    let service = Service(Arc::clone(&lifecycle));
    let late = "configure has not ended within 60s; the component is unconfigured";
    assert_eq!(
        service.change(Transition::Configure, asked),
        Err(late.to_owned())
    );
    assert!(lifecycle.next().is_none());
}

#[test]
fn waiting_requests_have_a_bound_and_are_refused_at_the_end() {
    let lifecycle = lifecycle();
    let until = Instant::now() + LIMIT;
    let (answer, answered) = sync_channel(MOST_WAITING);
    for _ in 0..MOST_WAITING {
        let answer = answer.clone();
        let done = Box::new(move |result| drop(answer.try_send(result)));
        assert_eq!(
            lifecycle.request(Transition::Configure, until, done),
            Ok(())
        );
    }
    let more = lifecycle.request(Transition::Configure, until, Box::new(drop));
    assert_eq!(more, Err("16 other transitions wait".to_owned()));
    lifecycle.end();
    assert_eq!(
        answered.try_iter().filter(Result::is_err).count(),
        MOST_WAITING
    );
    assert!(lifecycle.next().is_none());
    let more = lifecycle.request(Transition::Configure, until, Box::new(drop));
    assert_eq!(more, Err("the component ends".to_owned()));
}
