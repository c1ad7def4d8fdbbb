//! `ping` and `pong`, written by hand over iceoryx2: the reference for generated components.
//!
//! `bench_peer ping|pong ROOT PREFIX` are the pair; `bench_peer watch ROOT PREFIX` prints the
//! values of a pair, as `rcdeploy echo` does;
//! `bench_peer hold publishers|subscribers|servers|clients COUNT ROOT PREFIX` holds many ports. The
//! services have the settings of our backend (overflow and depth of topics, order and queues of
//! calls, limits of ports), bodies are `[u8]`, and a waiting program sleeps in `poll` on the
//! descriptor of its listener. The program omits what only our backend does: envelopes, type
//! hashes, growing memory, monitoring the peer's process, a periodic `compute`.

mod hold;
mod ping;
mod pong;
mod services;
mod watch;

use services::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ping", root, prefix] => ping::run(root, prefix),
        ["pong", root, prefix] => pong::run(root, prefix),
        ["watch", root, prefix] => watch::run(root, prefix),
        ["hold", role, count, root, prefix] => hold::run(role, count, root, prefix),
        _ => Err(Failure::from(
            "usage: bench_peer ping|pong|watch ROOT PREFIX | hold ROLE COUNT ROOT PREFIX",
        )),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench_peer: error: {error}");
            ExitCode::from(3)
        }
    }
}
