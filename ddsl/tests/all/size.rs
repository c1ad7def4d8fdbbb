//! Large texts are processed in linear time. The limit is far above that time, and far below
//! quadratic time.

use rc_diagnostics::SourceMap;
use rc_syntax::MemoryLoader;
use std::time::{Duration, Instant};

fn read(text: String) -> (usize, usize) {
    let start = Instant::now();
    let mut sources = SourceMap::new();
    let source = sources.add("n.ddsl", text);
    let (deployment, found) = rc_ddsl::load(&mut sources, &MemoryLoader::default(), source);
    let deployment = deployment.expect("a deployment");
    let count = deployment.instances.len();
    rc_ddsl::connect(&deployment, &vec![None; count]);
    let taken = start.elapsed();
    assert!(taken < Duration::from_secs(20), "{taken:?}");
    (count, found.iter().count())
}

#[test]
fn a_megabyte_of_components_is_read() {
    let chain = |i: usize| {
        format!(
            "Component c{i} {{ cdsl \"../a/a.cdsl\"; after c{}; }};\nbind c{i}.A -> c0.A;\n",
            i + 1
        )
    };
    let chain: String = (0..10_000).map(chain).collect();
    // The last component ends the chain or closes a cycle.
    for (last, expected) in [("", 0), ("after c0;", 1)] {
        let last = format!("Component c10000 {{ cdsl \"a\"; {last} }};");
        let text = format!("Deployment n {{\n{chain}{last}}};");
        assert_eq!(read(text), (10_001, expected));
    }
}

#[test]
fn thousands_of_groups_are_read() {
    let group = |i: usize| {
        format!(
            "Group g{i} {{ Group h {{ Component c {{ cdsl \"a\"; }}; export A; }}; export A; }};\nbind g{i}.A -> g{i}.h.c.A;\n"
        )
    };
    let groups: String = (0..8_000).map(group).collect();
    assert_eq!(read(format!("Deployment n {{\n{groups}}};")), (8_000, 0));
}
