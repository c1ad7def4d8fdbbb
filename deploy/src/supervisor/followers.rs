//! The followers that a source of time expects.

use rc_deploy_network::plan::Component;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// The option that lists the followers of a source of time.
const FOLLOWERS: &str = "--followers";

/// `component` without its followers in `gone`, the names of processes that have ended: a source of
/// time would wait for them in its first tick.
pub(super) fn without_followers<'a>(
    component: &'a Component,
    gone: &BTreeSet<String>,
) -> Cow<'a, Component> {
    let option = component.args.iter().position(|arg| arg == FOLLOWERS);
    let Some(at) = option.filter(|at| at + 1 < component.args.len()) else {
        return Cow::Borrowed(component);
    };
    let followers = component.args[at + 1].split(',');
    let here: Vec<&str> = followers.filter(|name| !gone.contains(*name)).collect();
    let here = here.join(",");
    let mut component = component.clone();
    if here.is_empty() {
        component.args.drain(at..at + 2);
    } else {
        component.args[at + 1] = here;
    }
    Cow::Owned(component)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_source_of_time_does_not_expect_followers_that_have_ended() {
        let mut source: Component = serde_json::from_value(serde_json::json!({
            "name": "clock", "executable": "clock", "directory": PathBuf::from("/"),
        }))
        .expect("a component");
        let gone = BTreeSet::from(["arm.monitor".to_owned(), "b".to_owned()]);
        let mut args = |text: &str| {
            source.args = text.split(' ').map(str::to_owned).collect();
            without_followers(&source, &gone).args.join(" ")
        };
        assert_eq!(
            args("--clock source --followers a,arm.monitor,b,c --name x"),
            "--clock source --followers a,c --name x"
        );
        assert_eq!(
            args("--clock source --followers b --name x"),
            "--clock source --name x"
        );
        assert_eq!(args("--clock system"), "--clock system");
        assert_eq!(args("--x --followers"), "--x --followers");
        assert_eq!(args("--followers a,b"), "--followers a");
    }
}
