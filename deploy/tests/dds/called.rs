//! Calls through an adaptor, between processes: a server in shared memory counts in millimetres, its
//! client in DDS in metres. Requests, replies and exceptions are converted.

use crate::adapted::up;
use crate::python_site::{second_component, workspace};
use rc_test_site::site::Site;

const INTERFACE: &str = r#"module Range
{
    struct Distance
    {
        @unit("UNIT") float x;
    };

    exception TooFar
    {
        @unit("UNIT") float by;
        string what;
    };

    interface Ranger
    {
        Distance twice(@unit("UNIT") float at, string name) throws TooFar;
    };
};
"#;

const RANGER: &str = "import \"Range.idsl\";\n\nComponent range_server\n{\n    Communications\n    {\n        \
    implements Ranger;\n    };\n    language python;\n    period 1s;\n};\n";
const ASKER: &str = "import \"Range.idsl\";\n\nComponent range_client\n{\n    Communications\n    {\n        \
    requires Ranger(dds);\n    };\n    language python;\n    period 50ms;\n};\n";

const OF_RANGER: &str = r#"from range_server import Context, Distance, TooFar, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None: ...

    def ranger_twice(self, ctx: Context, at: float, name: str) -> Distance:
        print("asked", at, name, flush=True)
        if name == "broken":
            raise RuntimeError("the ranger is broken")
        if at > 5000.0:
            raise TooFar(by=at - 5000.0, what=name)
        return Distance(2.0 * at)
"#;
const OF_ASKER: &str = r#"import robocomp

from range_client import Context, TooFar, Worker


class SpecificWorker(Worker):
    def compute(self, ctx: Context) -> None:
        for at, name in ((1.5, "near"), (7.0, "far"), (2.0, "broken"), (float("3e38"), "huge")):
            try:
                print(name, ctx.ranger.twice(at, name).x, flush=True)
            except TooFar as error:
                print(name, "too far by", error.by, error.what, flush=True)
            except robocomp.CallError as error:
                print(name, type(error).__name__, error, flush=True)
"#;

#[test]
fn calls_and_exceptions_are_converted_between_two_middlewares() {
    let test = "calls_and_exceptions_are_converted_between_two_middlewares";
    let [ours, theirs] = ["m", "mm"].map(|unit| INTERFACE.replace("UNIT", unit));
    let files = [
        ("range_client.cdsl", ASKER),
        ("Range.idsl", &ours),
        ("src/specific_worker.py", OF_ASKER),
    ];
    let Some(site) = workspace("called", "range_client", &files, test) else {
        return;
    };
    let files = [
        ("range_server.cdsl", RANGER),
        ("Range.idsl", &theirs),
        ("src/specific_worker.py", OF_RANGER),
    ];
    second_component(&site, "range_server", &files);
    site.write_ddsl(
        "Deployment patrol\n{\n    middleware iceoryx2;\n    middleware dds { domain 66; interfaces \"lo\"; };\n    \
         Component range_server { cdsl \"range_server/range_server.cdsl\"; middleware iceoryx2; restart always; };\n    \
         Component range_client { cdsl \"range_client/range_client.cdsl\"; middleware iceoryx2; };\n    \
         bind range_client.Ranger -> range_server.Ranger { convert via process; };\n};\n",
    );
    let up = up(&site, "66");
    assert_eq!(up.code, 0, "{up:?}");
    for line in [
        "near 3.0",
        "far too far by 2.0 far",
        "broken Refused",
        "the ranger is broken",
        // The number does not fit a `float` in millimetres: the adaptor refuses it with the reason.
        "huge Refused",
    ] {
        site.await_in_log("range_client", line);
    }
    for line in ["asked 1500.0 near", "asked 7000.0 far"] {
        site.await_in_log("range_server", line);
    }
    assert_eq!(site.count_in_log("range_server", " huge"), 0);
    let slot = site.ask("range_client_Ranger_adaptor", "status")["slots"][0].clone();
    assert!(slot["converted"]["messages"].as_u64() > Some(2), "{slot}");
    assert!(slot["converted"]["bad_values"].as_u64() > Some(0), "{slot}");
    // The status of the network names the slot, where the value goes and what is wrong.
    Site::until("the trouble", || {
        let status = site.rcdeploy(&["status", &site.network], false).stdout;
        let mut lines = status.lines();
        lines.any(|line| {
            line.contains("bad-value: slot provider refused ")
                && line.contains(" to `range_server.Ranger`: the number at byte ")
                && line.ends_with("does not fit its type in the unit of the receiver")
        })
    });

    // Without the server, a call fails with the reason; with the next one it is served again.
    let stop = site.rcdeploy(&["stop", &site.network, "range_server"], false);
    assert_eq!(stop.code, 0, "{stop:?}");
    site.await_in_log(
        "range_client",
        &format!("no server at `{}/range_server", site.network),
    );
    let start = site.rcdeploy(&["start", &site.network, "range_server"], false);
    assert_eq!(start.code, 0, "{start:?}");
    let near = site.count_in_log("range_client", "near 3.0");
    Site::until("a call is served", || {
        site.count_in_log("range_client", "near 3.0") > near
    });
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
