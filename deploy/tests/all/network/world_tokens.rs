//! Components that share a world: questions with tokens, and recordings that live again.

use rc_test_site::site::Site;
use std::time::Duration;

/// The network of `components/networks/home.ddsl`.
const HOME: &str = include_str!("../../../../components/networks/home.ddsl");

/// Two components that change and read one world.
const PEERS: &str = r#"Deployment patrol
{
    World g { schema "../interfaces/home.gdsl"; };
    Component reader { cdsl "PEER"; };
    Component writer { cdsl "PEER"; parameters { rounds ROUNDS; }; };
    bind writer.other -> reader.reads;
    external reader.other;
};
"#;

fn peer() -> &'static str {
    concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/programs/world_peer/world_peer.cdsl"
    )
}

/// Everything that replicas send, their digests among it, is what it was.
#[test]
fn recorded_components_with_a_world_live_again_exactly() {
    let site = Site::new("world_exact");
    let exact = "record { exact; };";
    let peers = PEERS.replace("\"PEER\";", &format!("\"{}\"; {exact}", peer()));
    site.write_ddsl(&peers.replace("ROUNDS", "100"));
    let home = HOME.replace("Deployment home", "Deployment patrol");
    let other = Site::new("world_exact_home");
    other.write_ddsl(&home.replace(".cdsl\";", &format!(".cdsl\"; {exact}")));
    for site in [&site, &other] {
        let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
        assert_eq!(up.code, 0, "{up:?}");
    }
    site.await_in_log("writer", "100 changes were read, 0 of them wrongly");
    other.await_in_log("room_keeper", "door front is open by");
    let killed = other.rcdeploy(&["restart", &other.network, "door_finder"], false);
    assert_eq!(killed.code, 0, "{killed:?}");
    let seen = other.count_in_log("room_keeper", "is open by");
    Site::until("the new finder tells more", || {
        other.count_in_log("room_keeper", "is open by") > seen + 20
    });
    for (site, names) in [
        (&site, ["writer", "reader"]),
        (&other, ["room_keeper", "door_finder"]),
    ] {
        let down = site.rcdeploy(&["down", &site.network], false);
        assert_eq!(down.code, 0, "{down:?}");
        site.assert_nothing_left();
        for name in names {
            let args = ["replay", "--check", "--format", "json", &site.network, name];
            let ran = site.rcdeploy(&args, false);
            assert_eq!(ran.code, 0, "{name}: {ran:?}");
            let report: serde_json::Value = serde_json::from_str(&ran.stdout).expect("a report");
            assert_eq!(report["equal"], true, "{name}: {ran:?}");
            assert!(report["compared"].as_u64() > Some(5), "{name}: {ran:?}");
        }
    }
}

/// Each question has the token of a change of two elements: its answer has both, of this change.
/// `RC_WORLD_READS` sets how many there are.
#[test]
fn a_question_with_a_token_reads_what_its_asker_has_written() {
    let site = Site::new("world_tokens");
    let rounds = std::env::var("RC_WORLD_READS").unwrap_or_else(|_| "2000".to_owned());
    site.write_ddsl(&PEERS.replace("PEER", peer()).replace("ROUNDS", &rounds));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    Site::until_within(
        Duration::from_mins(10),
        "all questions are answered",
        || site.count_in_log("writer", " changes were read, ") > 0,
    );
    let text = format!("{rounds} changes were read, 0 of them wrongly");
    assert_eq!(
        site.count_in_log("writer", &text),
        1,
        "{}",
        site.log("writer")
    );
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}

const START: &str =
    r#"{"nodes": [{"id": "1:1", "type": "room", "attributes": {"name": "hall", "length": 4.0}}]}"#;

/// Two keepers of one world: what the network says of it is there once, and is kept.
#[test]
fn keepers_start_a_world_once_and_keep_it_as_their_network_says() {
    let site = Site::new("world_kept");
    let schema = "schema \"../interfaces/home.gdsl\";";
    let home = HOME.replace("Deployment home", "Deployment patrol");
    let text = home.replace(
        schema,
        &format!("{schema} start \"start.graph\"; keep \"kept.graph\" 200ms;"),
    );
    assert_ne!(text, home);
    site.write_ddsl(&text);
    site.write("start.graph", START);
    let check = site.rcdeploy(&["check", "--profile", "dev"], true);
    let warning = "no component of the network is a `world_keeper`: `keep` has no effect";
    assert!(check.stderr.contains("no-world-keeper"), "{check:?}");
    assert!(check.stderr.contains(warning), "{check:?}");

    let keeper = |name: &str, more: &str| {
        format!("Component {name} {{ cdsl \"../world_keeper/world_keeper.cdsl\"; {more} }};\n")
    };
    let other = site.path("networks/other.graph").display().to_string();
    let keepers = [
        keeper("keeper", ""),
        keeper("spare", &format!("parameters {{ keep \"{other}\"; }};")),
    ];
    let text = text.replacen("Component", &format!("{}Component", keepers.concat()), 1);
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    assert!(!up.stderr.contains("no-world-keeper"), "{up:?}");
    site.await_in_log("room_keeper", "door front of 0.8 m");
    let read = |name: &str| {
        let path = site.path("networks").join(name);
        std::fs::read_to_string(path).unwrap_or_default()
    };
    for name in ["kept.graph", "other.graph"] {
        Site::until("the world is kept", || read(name).contains("\"front\""));
        assert_eq!(read(name).matches("\"hall\"").count(), 1, "{}", read(name));
    }
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();

    // A keeper that cannot read what is kept would not start.
    let whole = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_eq!(whole.code, 0, "{whole:?}");
    let kept = read("kept.graph");
    site.write("kept.graph", &kept[..kept.len() / 2]);
    let damaged = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_eq!(damaged.code, 1, "{damaged:?}");
    let error = "the world that `kept.graph` keeps cannot be read: it has errors";
    let help = "fix the file, or move it away: then the world begins again";
    assert!(damaged.stderr.contains(error), "{damaged:?}");
    assert!(damaged.stderr.contains(help), "{damaged:?}");
}
