//! Diagnostics and connections of the networks that `.ddsl` texts describe.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_cdsl::Component;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use rc_vocabulary::Middleware;
use std::collections::HashMap;

/// All interfaces of these tests.
const INTERFACES: [(&str, &str); 4] = [
    (
        "Laser.idsl",
        "module L { struct D { int a; }; interface Laser { D get(); }; };",
    ),
    (
        "Pub.idsl",
        "module P { interface Pub { void push(int x); }; };",
    ),
    (
        "InnerModel.idsl",
        include_str!("../../../components/interfaces/InnerModel.idsl"),
    ),
    (
        "TransformPub.idsl",
        include_str!("../../../components/interfaces/TransformPub.idsl"),
    ),
];

/// A component named `name`. Its communications may begin with `[` and another definition of
/// `Laser`, which ends with `]`; behind `|||` stand its prototypes. One whose name ends with `_python` is in Python,
/// one with `_cpp` in C++, that of one with `_viewer` holds a tree, and that of one with `_old` has another `InnerModel`.
fn component(sources: &mut SourceMap, name: &str, communications: &str) -> Component {
    let mut interfaces = INTERFACES.to_vec();
    let mut prototypes = "";
    let own = communications
        .strip_prefix('[')
        .and_then(|rest| rest.rsplit_once(']'));
    let communications = match own {
        Some((laser, rest)) => {
            let (laser, meanings) = laser.split_once("|||").unwrap_or((laser, ""));
            interfaces[0].1 = laser;
            if !meanings.is_empty() {
                interfaces.push(("Laser.dproto", meanings));
                prototypes = "import \"Laser.dproto\";";
            }
            rest
        }
        None => communications,
    };
    if name.ends_with("_old") {
        interfaces[2].1 = "module RcInnerModel { interface InnerModel { int getPoseAt(); }; };";
    }
    let words: Vec<&str> = communications
        .split([' ', ',', ';', '[', '(', '{', '\n'])
        .collect();
    let imports = ["Laser", "Pub", "InnerModel", "TransformPub"]
        .into_iter()
        .filter(|import| words.contains(import));
    let imports: String = imports.map(|i| format!("import \"{i}\";")).collect();
    let language = match name.rsplit_once('_') {
        Some((_, "python")) => "python",
        Some((_, "cpp")) => "cpp",
        Some((_, "viewer")) => "rust; options InnerModelViewer",
        _ => "rust",
    };
    let cdsl = format!(
        "{imports}{prototypes}\nComponent {name} {{ Communications {{ {communications} }}; language {language}; }};"
    );
    let source = sources.add(format!("{name}.cdsl"), cdsl);
    let loader = MemoryLoader::new(interfaces);
    let (component, mut found) = rc_cdsl::load(sources, &loader, source);
    let mut component = component.expect("a component");
    found.extend(rc_cdsl::meanings(&mut component, sources, &loader, source));
    let found = render(sources, &found, Format::Short);
    assert!(!found.contains("error["), "{found}");
    component
}

/// Checks the diagnostics for a deployment of the components `(cdsl, communications)`, and returns
/// its connections.
pub(crate) fn network(body: &str, described: &[(&str, &str)], expected: &Expect) -> Vec<String> {
    let (connections, found) = connected(body, described);
    expected.assert_eq(&found);
    connections
}

/// The connections of a deployment, and its diagnostics.
fn connected(body: &str, described: &[(&str, &str)]) -> (Vec<String>, String) {
    let mut sources = SourceMap::new();
    let components: HashMap<&str, Component> = described
        .iter()
        .map(|(name, communications)| (*name, component(&mut sources, name, communications)))
        .collect();
    let source = sources.add("n.ddsl", format!("Deployment n {{\n{body}}};"));
    let loader = MemoryLoader::default();
    let (deployment, found) = rc_ddsl::load(&mut sources, &loader, source);
    let mut all = found;
    assert!(deployment.is_some(), "a deployment");
    let Some(mut deployment) = deployment else {
        return (Vec::new(), String::new());
    };
    let name = deployment.name.text.clone();
    let parts = deployment.instances.iter_mut().map(|instance| {
        let plain = components.get(instance.cdsl.as_ref()?.text.as_str())?;
        Some(rc_ddsl::expand(&name, instance, plain, &mut all).unwrap_or_else(|| plain.clone()))
    });
    let owned: Vec<Option<Component>> = parts.collect();
    let mut parts: Vec<Option<&Component>> = owned.iter().map(Option::as_ref).collect();
    let outside: Vec<Option<&Component>> = deployment
        .externals
        .iter()
        .map(|external| components.get(external.peer.as_ref()?.cdsl.text.as_str()))
        .collect();
    let both = [parts.as_slice(), &outside].concat();
    let adaptors = rc_ddsl::add_adaptors(&mut deployment, &both, &mut all);
    parts.extend(adaptors.iter().map(|adaptor| Some(&adaptor.component)));
    let both = [parts.as_slice(), &outside].concat();
    let (network, found) = rc_ddsl::connect(&deployment, &both);
    all.extend(found);
    let found = render(&sources, &all, Format::Short);
    let name = |end: rc_ddsl::Endpoint| {
        format!(
            "{}.{}",
            deployment.instances[end.instance].path,
            parts[end.instance].expect("connected").slots[end.slot].name
        )
    };
    let has_peers = outside.iter().any(Option::is_some);
    let externals = network.externals.iter().filter(|_| has_peers);
    let externals = externals.map(|(end, address)| {
        let address = address.as_ref().map_or("", |address| &address.text);
        let converts = network.conversion(*end);
        let converts = converts.map_or(String::new(), |made| format!(" converts {made}"));
        format!("{} with outside `{address}`{converts}", name(*end))
    });
    let connections = network.connections.iter();
    let connections = connections
        .map(|c| {
            let conversion = network.conversions.get(c);
            let converts = conversion.map(|made| format!(" converts {made} by {}", made.plan));
            let converts = converts.unwrap_or_default();
            let over = network.transports[c];
            let over = match over {
                Middleware::Iceoryx2 => String::new(),
                over => format!(" over {over}"),
            };
            format!(
                "{} -> {}{converts}{over}",
                name(c.consumer),
                name(c.provider)
            )
        })
        .chain(externals)
        .collect();
    (connections, found)
}

/// Like [`network`], for instances `(name, communications)` outside groups. `binds` begins on line
/// 2.
pub(crate) fn connect(instances: &[(&str, &str)], binds: &str, expected: &Expect) -> Vec<String> {
    network(&flat(instances, binds), instances, expected)
}

/// The connections of instances as those of [`connect`], whose network has no errors.
pub(crate) fn made(instances: &[(&str, &str)], binds: &str) -> Vec<String> {
    let (connections, found) = connected(&flat(instances, binds), instances);
    assert!(!found.contains("error["), "{found}");
    connections
}

/// The connections and the diagnostics of instances as those of [`connect`].
pub(crate) fn connected_flat(instances: &[(&str, &str)], binds: &str) -> (Vec<String>, String) {
    connected(&flat(instances, binds), instances)
}

fn flat(instances: &[(&str, &str)], binds: &str) -> String {
    let components = instances
        .iter()
        .map(|(name, _)| format!("Component {name} {{ cdsl \"{name}\"; }};\n"));
    format!("{binds}\n{}", components.collect::<String>())
}

#[test]
fn matching_slots_are_connected() {
    let connections = connect(
        &[
            ("a", "requires Laser; subscribesTo Pub;"),
            ("b", "implements Laser; publishes Pub;"),
            ("c", "publishes Pub;"),
        ],
        "",
        &expect![[""]],
    );
    expect![[r#"
        a.Laser -> b.Laser
        a.Pub -> b.Pub
        a.Pub -> c.Pub"#]]
    .assert_eq(&connections.join("\n"));
}

#[test]
fn missing_and_ambiguous_providers_are_reported() {
    connect(
        &[("a", "requires Laser; subscribesTo Pub;")],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[no-provider]: `a.Laser` requires `L::Laser`, but no component implements it; required here at a.cdsl:2:41 (if a peer outside the network implements it, write `external a.Laser;`)
            n.ddsl:3:11: warning[no-publisher]: `a.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at a.cdsl:2:61 (if a peer outside the network publishes it, write `external a.Pub;`)
        "#]],
    );
    connect(
        &[
            ("a", "requires Laser;"),
            ("b", "implements Laser, Laser;"),
            ("c", "implements Laser; publishes Pub;"),
        ],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[several-providers]: several providers for `a.Laser`: `b.Laser`, `b.Laser1`, `c.Laser` (choose one: `bind a.Laser -> b.Laser;`)
            n.ddsl:5:11: note[no-subscriber]: `c.Pub` has no subscriber
        "#]],
    );
    let connections = connect(
        &[("a", "requires Laser;"), ("b", "implements Laser, Laser;")],
        "bind a.Laser -> b.Laser1;",
        &expect![[""]],
    );
    expect!["a.Laser -> b.Laser1"].assert_eq(&connections.join("\n"));
}

#[test]
fn binds_connect_matching_slots_only() {
    let three = [
        ("a", "requires Laser; subscribesTo Pub;"),
        ("b", "implements Laser; publishes Pub;"),
    ];
    connect(
        &three,
        "bind a.laser -> b.Lasre;",
        &expect![[r#"
            n.ddsl:2:8: error[unknown-slot]: `a` has no slot `laser`; its component at a.cdsl:2:11 (did you mean `Laser`?)
            n.ddsl:2:19: error[unknown-slot]: `b` has no slot `Lasre`; its component at b.cdsl:2:11 (did you mean `Laser`?)
        "#]],
    );
    connect(
        &three,
        "bind b.Laser -> a.Laser;",
        &expect![[r#"
            n.ddsl:2:6: error[wrong-direction]: expected a consumer left of `->`, but `b.Laser` implements its interface; declared here at b.cdsl:2:43 (write the slot that requires or subscribes left of `->`)
        "#]],
    );
    connect(
        &three,
        "bind a.Laser -> a.Pub;",
        &expect![[r#"
            n.ddsl:2:17: error[wrong-direction]: `a.Laser` needs a slot that implements its interface, but `a.Pub` subscribesTo it; declared here at a.cdsl:2:61
        "#]],
    );
    connect(
        &three,
        "bind a.Laser -> b.Pub;",
        &expect![[r#"
            n.ddsl:2:17: error[wrong-direction]: `a.Laser` needs a slot that implements its interface, but `b.Pub` publishes it; declared here at b.cdsl:2:60
        "#]],
    );
    connect(
        &three,
        "bind a.Laser -> b.Laser;\nbind a.Laser -> b.Laser;",
        &expect![[r#"
            n.ddsl:3:6: error[bound-twice]: `a.Laser` is bound twice to `b.Laser`; first bound here at n.ddsl:2:6
        "#]],
    );
}

#[test]
fn both_ends_must_agree_on_type_and_qos() {
    connect(
        &[
            ("a", "requires Laser;"),
            (
                "b",
                "[module L { struct D { long a; }; interface Laser { D get(); }; };]implements Laser;",
            ),
        ],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[type-mismatch]: `a.Laser` and `b.Laser` have different definitions of `L::Laser`: L::Laser/get differs; first definition at Laser.idsl:1:43; second definition at Laser.idsl:1:44
        "#]],
    );
    connect(
        &[
            (
                "a",
                "subscribesTo Pub { reliability reliable; durability transient_local; };",
            ),
            ("b", "publishes Pub { reliability best_effort; };"),
        ],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[qos-mismatch]: `a.Pub` requests reliability reliable, but `b.Pub` offers best_effort; requested here at a.cdsl:2:45; offered here at b.cdsl:2:42
            n.ddsl:3:11: error[qos-mismatch]: `a.Pub` requests durability transient_local, but `b.Pub` offers volatile; requested here at a.cdsl:2:45; offered here at b.cdsl:2:42
        "#]],
    );
    connect(
        &[
            (
                "a",
                "subscribesTo Pub { deadline 100ms; liveliness 1s; lifespan 1s; };",
            ),
            ("b", "publishes Pub { deadline 0.2s; lifespan 2s; };"),
        ],
        "",
        &expect![[r#"
            n.ddsl:3:11: error[qos-mismatch]: `a.Pub` requests deadline 100ms, but `b.Pub` offers 200ms; requested here at a.cdsl:2:45; offered here at b.cdsl:2:42
            n.ddsl:3:11: error[qos-mismatch]: `a.Pub` requests liveliness 1s, but `b.Pub` offers none; requested here at a.cdsl:2:45; offered here at b.cdsl:2:42
        "#]],
    );
    connect(
        &[
            ("a", "subscribesTo Pub { deadline 100ms; };"),
            ("b", "publishes Pub { deadline 100ms; liveliness 1s; };"),
        ],
        "",
        &expect![[""]],
    );
    connect(
        &[("a", "requires Laser(dds);"), ("b", "implements Laser;")],
        "bind a.Laser -> b.Laser; middleware iceoryx2;",
        &expect![[r#"
            n.ddsl:2:6: error[middleware-mismatch]: `a.Laser` and `b.Laser` use different middleware: `dds` and `iceoryx2` (give both ends one middleware, or let a process stand between them: `bind a.Laser -> b.Laser { convert via process; };`)
        "#]],
    );
}

#[test]
fn cycles_of_requires_are_reported() {
    connect(
        &[
            ("a", "requires Laser as other; implements Laser;"),
            ("b", "requires Laser as other; implements Laser;"),
        ],
        "bind a.other -> b.Laser;\nbind b.other -> a.Laser;",
        &expect![[r#"
            n.ddsl:4:11: warning[requires-cycle]: cyclic requirements: a → b → a: simultaneous calls time out
        "#]],
    );
}

#[test]
fn a_component_does_not_wait_for_asynchronous_queries() {
    connect(
        &[
            (
                "a",
                "requires Laser as other { asynchronous true; }; implements Laser;",
            ),
            ("b", "requires Laser as other; implements Laser;"),
        ],
        "bind a.other -> b.Laser;\nbind b.other -> a.Laser;",
        &expect![[""]],
    );
}

#[test]
fn after_a_requirer_is_reported() {
    let wanted = expect![[r#"
        n.ddsl:2:39: error[after-cycle]: cyclic start order: lidar after g contains g.one requires lidar (remove this `after`: providers start first, and components that require each other start together)
    "#]];
    let body = "Component lidar { cdsl \"lidar\"; after g; };\nGroup g {\n Component one { cdsl \"user\"; };\n};\nComponent two { cdsl \"user\"; after lidar; };\nComponent three { cdsl \"user\"; };\n";
    network(body, &[LIDAR, USER], &wanted);
}

const LIDAR: (&str, &str) = ("lidar", "implements Laser; publishes Pub;");
const USER: (&str, &str) = ("user", "requires Laser; subscribesTo Pub;");

#[test]
fn slots_without_export_connect_inside_their_group_only() {
    let connections = network(
        "Group g {\n Component lidar { cdsl \"lidar\"; };\n Component user { cdsl \"user\"; };\n Group h { Component user { cdsl \"user\"; }; };\n};\n",
        &[LIDAR, USER],
        &expect![[""]],
    );
    expect![[r#"
        g.user.Laser -> g.lidar.Laser
        g.user.Pub -> g.lidar.Pub
        g.h.user.Laser -> g.lidar.Laser
        g.h.user.Pub -> g.lidar.Pub"#]]
    .assert_eq(&connections.join("\n"));
    let connections = network(
        "Group g { Component lidar { cdsl \"lidar\"; }; };\nComponent user { cdsl \"user\"; };\nGroup h { Component user { cdsl \"user\"; }; };\n",
        &[LIDAR, USER],
        &expect![[r#"
            n.ddsl:2:21: note[no-subscriber]: `g.lidar.Pub` has no subscriber
            n.ddsl:3:11: error[no-provider]: `user.Laser` requires `L::Laser`, but no component implements it; required here at user.cdsl:2:44 (`g.lidar.Laser` implements it: write `export Laser;` in group `g`)
            n.ddsl:3:11: warning[no-publisher]: `user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (`g.lidar.Pub` publishes it: write `export Pub;` in group `g`)
            n.ddsl:4:21: error[no-provider]: `h.user.Laser` requires `L::Laser`, but no component implements it; required here at user.cdsl:2:44 (`g.lidar.Laser` implements it: write `export Laser;` in group `g`)
            n.ddsl:4:21: warning[no-publisher]: `h.user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (`g.lidar.Pub` publishes it: write `export Pub;` in group `g`)
        "#]],
    );
    assert!(connections.is_empty());
}

#[test]
fn exported_slots_connect_in_every_group_that_exports_them() {
    let text = "Group g { export Laser, Pub;\n Group h { export Laser; Component lidar { cdsl \"lidar\"; }; };\n Component other { cdsl \"other\"; };\n};\nComponent user { cdsl \"user\"; };\n";
    let connections = network(
        text,
        &[
            LIDAR,
            USER,
            ("other", "publishes Pub; subscribesTo Pub as heard;"),
        ],
        &expect![[r#"
            n.ddsl:3:36: note[no-subscriber]: `g.h.lidar.Pub` has no subscriber
        "#]],
    );
    expect![[r#"
        g.other.heard -> g.other.Pub
        user.Laser -> g.h.lidar.Laser
        user.Pub -> g.other.Pub"#]]
    .assert_eq(&connections.join("\n"));
}

#[test]
fn binds_reach_through_exports() {
    let text = "Group a { export Laser; Component lidar { cdsl \"lidar\"; }; };\nGroup b { export Laser; Component lidar { cdsl \"lidar\"; }; };\n\
                Component user { cdsl \"user\"; }; Group c { export Laser; Component user { cdsl \"user\"; }; };\n";
    network(
        text,
        &[LIDAR, USER],
        &expect![[r#"
            n.ddsl:2:35: note[no-subscriber]: `a.lidar.Pub` has no subscriber
            n.ddsl:3:35: note[no-subscriber]: `b.lidar.Pub` has no subscriber
            n.ddsl:4:11: error[several-providers]: several providers for `user.Laser`: `a.lidar.Laser`, `b.lidar.Laser` (choose one: `bind user.Laser -> a.lidar.Laser;`)
            n.ddsl:4:11: warning[no-publisher]: `user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (`a.lidar.Pub` publishes it: write `export Laser, Pub;` in group `a`)
            n.ddsl:4:68: error[several-providers]: several providers for `c.user.Laser`: `a.lidar.Laser`, `b.lidar.Laser` (choose one in group `c`: `bind user.Laser -> a.lidar.Laser;`)
            n.ddsl:4:68: warning[no-publisher]: `c.user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (`a.lidar.Pub` publishes it: write `export Laser, Pub;` in group `a`)
        "#]],
    );
    let bound = format!("{text}bind user.Laser -> a.Laser;\nbind c.Laser -> b.lidar.Laser;\n");
    let connections = network(
        &bound,
        &[LIDAR, USER],
        &expect![[r#"
            n.ddsl:2:35: note[no-subscriber]: `a.lidar.Pub` has no subscriber
            n.ddsl:3:35: note[no-subscriber]: `b.lidar.Pub` has no subscriber
            n.ddsl:4:11: warning[no-publisher]: `user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (`a.lidar.Pub` publishes it: write `export Laser, Pub;` in group `a`)
            n.ddsl:4:68: warning[no-publisher]: `c.user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (`a.lidar.Pub` publishes it: write `export Laser, Pub;` in group `a`)
        "#]],
    );
    expect![[r#"
        user.Laser -> a.lidar.Laser
        c.user.Laser -> b.lidar.Laser"#]]
    .assert_eq(&connections.join("\n"));
}

#[test]
fn an_exported_name_means_one_slot() {
    network(
        "Group g { export Laser, Pub, Lasr;\n Component one { cdsl \"lidar\"; };\n Component two { cdsl \"lidar\"; };\n Group h { export Pub; Component user { cdsl \"user\"; }; };\n};\n\
         Component user { cdsl \"user\"; };\nbind user.Laser -> g.Laser;\n",
        &[LIDAR, USER],
        &expect![[r#"
            n.ddsl:2:18: error[ambiguous-export]: several slots in group `g` match `Laser`; candidate at n.ddsl:3:12; candidate at n.ddsl:4:12 (move one of them into a group of its own, or rename the slot with `as NAME`)
            n.ddsl:2:25: error[ambiguous-export]: several slots in group `g` match `Pub`; candidate at n.ddsl:3:12; candidate at n.ddsl:4:12 (move one of them into a group of its own, or rename the slot with `as NAME`)
            n.ddsl:2:30: error[unknown-export]: group `g` has no slot `Lasr` (did you mean `Laser`?)
            n.ddsl:5:34: error[several-providers]: several providers for `g.h.user.Laser`: `g.one.Laser`, `g.two.Laser` (choose one in group `g.h`: `bind user.Laser -> one.Laser;`)
            n.ddsl:7:11: warning[no-publisher]: `user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64
        "#]],
    );
    // A component with a syntax error may have the slot.
    network(
        "Group g { export Laser; Component one { cdsl \"unread\"; }; };\n",
        &[],
        &expect![[""]],
    );
    // An exported name means the provider, not the requirers inside the group.
    let connections = network(
        "Group g { export Laser; Component lidar { cdsl \"lidar\"; }; Component user { cdsl \"user\"; }; };\nComponent user { cdsl \"user\"; };\n",
        &[("lidar", "implements Laser;"), ("user", "requires Laser;")],
        &expect![[""]],
    );
    expect![[r#"
        g.user.Laser -> g.lidar.Laser
        user.Laser -> g.lidar.Laser"#]]
    .assert_eq(&connections.join("\n"));
}

#[test]
fn ends_in_different_middleware_or_domains_are_reported() {
    let components = [("lidar", "implements Laser;"), ("user", "requires Laser;")];
    let text = "middleware dds;\nGroup g { domain 3; export Laser; Component lidar { cdsl \"lidar\"; }; };\nComponent user { cdsl \"user\"; };\n";
    network(
        text,
        &components,
        &expect![[r#"
            n.ddsl:4:11: error[domain-mismatch]: `user.Laser` and `g.lidar.Laser` are in different domains: the default (0) and 3; set here at n.ddsl:3:11
        "#]],
    );
    let text = text.replace("domain 3", "middleware ros2");
    network(
        &text,
        &components,
        &expect![[r#"
            n.ddsl:4:11: error[middleware-mismatch]: `user.Laser` and `g.lidar.Laser` use different middleware: `dds` and `ros2` (give both ends one middleware, or let a process stand between them: `bind user.Laser -> g.lidar.Laser { convert via process; };`)
        "#]],
    );
}

#[test]
fn an_invalid_bind_is_reported_once() {
    network(
        "Component a { cdsl \"lidar\"; };\nComponent b { cdsl \"lidar\"; };\nComponent user { cdsl \"user\"; };\nbind user.Laser -> a.Lasre;\nbind user.Pub -> a.Pub;\nbind user.Pub -> a.Pub;\n",
        &[LIDAR, USER],
        &expect![[r#"
            n.ddsl:3:11: note[no-subscriber]: `b.Pub` has no subscriber
            n.ddsl:5:22: error[unknown-slot]: `a` has no slot `Lasre`; its component at lidar.cdsl:2:11 (did you mean `Laser`?)
            n.ddsl:7:6: error[bound-twice]: `user.Pub` is bound twice to `a.Pub`; first bound here at n.ddsl:6:6
        "#]],
    );
}

#[test]
fn peers_that_are_not_part_of_the_network() {
    let user = ("user", "requires Laser; subscribesTo Pub;");
    connect(
        &[user],
        "external user.Laser, user.Pub at \"robot/Pub\";",
        &expect![[""]],
    );
    // It connects to no component here, although one fits.
    let all = [user, ("lidar", "implements Laser; publishes Pub;")];
    let connections = connect(&all, "external user.Laser;", &expect![[""]]);
    assert_eq!(connections, ["user.Pub -> lidar.Pub"]);
    connect(
        &all,
        "bind user.Laser -> lidar.Laser; external user.Laser, user.Pub, lidar.Laser, user.Pub;",
        &expect![[r#"
            n.ddsl:2:42: error[bound-twice]: `user.Laser` is bound already; first bound here at n.ddsl:2:6
            n.ddsl:2:64: error[wrong-direction]: expected a consumer after `external`, but `lidar.Laser` implements its interface; declared here at lidar.cdsl:2:47 (remove it: peers outside the network need no declaration to use this slot over its middleware, unless values are converted for them: `{ cdsl "FILE"; convert; }`)
            n.ddsl:2:77: error[bound-twice]: `user.Pub` is bound already; first bound here at n.ddsl:2:54
            n.ddsl:4:11: note[no-subscriber]: `lidar.Pub` has no subscriber
        "#]],
    );
    connect(
        &[user],
        "external user.Lasr;",
        &expect![[r#"
        n.ddsl:2:15: error[unknown-slot]: `user` has no slot `Lasr`; its component at user.cdsl:2:11 (did you mean `Laser`?)
        n.ddsl:3:11: error[no-provider]: `user.Laser` requires `L::Laser`, but no component implements it; required here at user.cdsl:2:44 (if a peer outside the network implements it, write `external user.Laser;`)
        n.ddsl:3:11: warning[no-publisher]: `user.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at user.cdsl:2:64 (if a peer outside the network publishes it, write `external user.Pub;`)
    "#]],
    );
}

#[test]
fn peers_that_a_component_does_not_need() {
    let user = (
        "user",
        "requires Laser optional; subscribesTo Pub optional;",
    );
    connect(
        &[user],
        "",
        &expect![[r#"
        n.ddsl:3:11: note[no-provider]: `user.Laser` is optional, and no component implements `L::Laser`; required here at user.cdsl:2:44
        n.ddsl:3:11: note[no-publisher]: `user.Pub` is optional, and no component publishes `P::Pub`; subscribed here at user.cdsl:2:73
    "#]],
    );
    let lidar = ("lidar", "implements Laser; publishes Pub;");
    let connections = connect(&[user, lidar], "", &expect![[""]]);
    assert_eq!(
        connections,
        ["user.Laser -> lidar.Laser", "user.Pub -> lidar.Pub"]
    );
    // Several providers are as unclear as without the word.
    let other = ("other", "implements Laser;");
    connect(
        &[user, lidar, other],
        "",
        &expect![[r#"
        n.ddsl:3:11: error[several-providers]: several providers for `user.Laser`: `lidar.Laser`, `other.Laser` (choose one: `bind user.Laser -> lidar.Laser;`)
    "#]],
    );
}

#[test]
fn a_component_starts_without_a_peer_that_it_does_not_need() {
    let mut sources = SourceMap::new();
    let components = [
        component(&mut sources, "user", "requires Laser optional;"),
        component(&mut sources, "lidar", "implements Laser;"),
    ];
    let body =
        "Component user { cdsl \"user\"; }; Component lidar { cdsl \"lidar\"; after user; };";
    let source = sources.add("n.ddsl", format!("Deployment n {{ {body} }};"));
    let (deployment, found) = rc_ddsl::load(&mut sources, &MemoryLoader::default(), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let parts: Vec<_> = components.iter().map(Some).collect();
    let (network, found) = rc_ddsl::connect(&deployment.expect("a deployment"), &parts);
    // A required slot would contradict this `after`.
    assert_eq!(render(&sources, &found, Format::Short), "");
    assert_eq!(network.connections.len(), 1);
    assert!(
        network
            .required
            .iter()
            .all(std::collections::BTreeSet::is_empty)
    );
}

/// A proxy whose exports have errors has no component.
#[test]
fn slots_behind_a_proxy_without_a_component_are_not_missed() {
    let all = [
        ("server", "implements Laser; publishes Pub;"),
        ("client", "requires Laser; subscribesTo Pub;"),
    ];
    let body = |exports: &str| {
        format!(
            "Group arm {{ Component server {{ cdsl \"server\"; }}; export {exports}; proxy; }};
            Component client {{ cdsl \"client\"; }};"
        )
    };
    network(&body("Laser, Pub"), &all, &expect![[""]]);
    network(
        &body("Laser"),
        &all,
        &expect![[r#"
        n.ddsl:2:23: note[no-subscriber]: `arm.server.Pub` has no subscriber
        n.ddsl:3:23: warning[no-publisher]: `client.Pub` subscribes to `P::Pub`, but no component publishes it; subscribed here at client.cdsl:2:66 (`arm.server.Pub` publishes it: write `export Laser, Pub;` in group `arm`)
    "#]],
    );
}

#[test]
fn wrong_proxies_are_reported() {
    let all = [
        ("server", "implements Laser;"),
        ("client", "requires Laser;"),
    ];
    network(
        "Group arm { Component server { cdsl \"server\"; }; proxy; proxy dds; };
        Group leg { Component server { cdsl \"server\"; }; export Laser; proxy; };
        Component client { cdsl \"client\"; };
        bind client.Laser -> leg.server.Laser;",
        &all,
        &expect![[r#"
            n.ddsl:2:50: error[proxy-without-exports]: group `arm` has a proxy and exports nothing (name the slots that are visible outside: `export NAME, NAME;`, or remove `proxy`)
            n.ddsl:2:57: error[repeated-clause]: duplicate clause `proxy`; first used here at n.ddsl:2:50
            n.ddsl:5:34: error[behind-proxy]: `server` is behind the proxy of group `leg`, and cannot be reached from outside; the proxy at n.ddsl:3:72 (write `leg.Laser`)
        "#]],
    );
}

#[test]
fn a_proxy_runs_where_its_group_begins() {
    let text = "Deployment n { Host nuc { address \"10.0.0.9\"; };
        Group outer { Group inner { Process eyes { host nuc; Component a { cdsl \"a\"; }; }; export Laser; proxy; };
        export Laser; proxy; }; };";
    let mut sources = SourceMap::new();
    let source = sources.add("n.ddsl", text.to_owned());
    let (deployment, found) = rc_ddsl::load(&mut sources, &MemoryLoader::default(), source);
    assert!(
        found.is_empty(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    let instances = deployment.expect("a deployment").instances;
    let hosts = instances
        .iter()
        .map(|one| (one.path.as_str(), one.host.map(|(host, _)| host)));
    let expected = ["outer", "outer.inner", "outer.inner.a"].map(|path| (path, Some(0)));
    assert_eq!(hosts.collect::<Vec<_>>(), expected);
}
