//! The command line of every generated binary.

use crate::arguments::{Arguments, Files, check_slot};
use crate::description::{Description, Slot};
use crate::time::ClockChoice;
use lexopt::prelude::{Long, Short, ValueExt};
use rc_diagnostics::foreign;
use rc_management::component::Role;
use rc_middleware::linked::GivenArguments;
use rc_middleware::{Address, Settings};
use rc_vocabulary::{Middleware, member};
use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

/// The longest time that `--wait` takes, in seconds.
const LONGEST_WAIT: u64 = 24 * 60 * 60;

/// Action that the command line requests.
#[derive(Debug)]
pub(crate) enum Task {
    Run(Arguments),
    Check(Arguments),
    /// Repeat the exact recording at standard input.
    Replay(Arguments),
    /// Ask a running component, for at most this time until it is ready.
    Probe(Arguments, Duration),
    Print(String),
}

/// Parses the command line. An error says what is allowed.
pub(crate) fn parse(
    description: &Description,
    args: impl IntoIterator<Item = OsString>,
) -> Result<Task, lexopt::Error> {
    let (args, of_nodes) = split(args);
    let mut parser = lexopt::Parser::from_args(args);
    let mut check = false;
    let mut probe = false;
    let mut replay = false;
    let mut wait = None;
    let mut schema_text = None;
    let mut out = Arguments::new("default", description.name);
    while let Some(arg) = parser.next()? {
        match arg {
            Long("network") => out.network = parse_name("--network", &parser.value()?.string()?)?,
            Long("name") => out.name = parse_name("--name", &parser.value()?.string()?)?,
            Long("config") => out.config = Some(parser.value()?.into()),
            Long("log") => out.log = Some(parser.value()?.string()?),
            Long("bind") => {
                let (slot, address) = binding(description, &parser.value()?.string()?)?;
                out.bindings.insert(slot, address);
            }
            Long("transport") => {
                let (slot, transports) = transports(description, &parser.value()?.string()?)?;
                out.transports.insert(slot, transports);
            }
            Long("reliable") => {
                let list = parser.value()?.string()?;
                let slots = list.split(',').map(|slot| subscriber(description, slot));
                out.reliable = slots.collect::<Result<_, _>>()?;
            }
            Long("members") => {
                let (array, members) = members(description, &parser.value()?.string()?)?;
                out.members.insert(array, members);
            }
            Long("convert") => {
                let (slot, plan) = conversion(description, &parser.value()?.string()?)?;
                out.conversions.plans.insert(slot, plan);
            }
            Long("frames") => {
                let (slot, tree) = frames(description, &parser.value()?.string()?)?;
                out.conversions.trees.insert(slot, tree);
            }
            Long("providers") => {
                let (slot, providers) = providers(description, &parser.value()?.string()?)?;
                out.conversions.providers.insert(slot, providers);
            }
            Long("schema") => {
                let text: &mut String = schema_text.get_or_insert_default();
                text.push_str(&parser.value()?.string()?);
            }
            Long("set-middleware") => setting(&parser.value()?.string()?, &mut out.settings)?,
            Long("clock") => out.clock = ClockChoice::parse(&parser.value()?.string()?)?,
            Long("followers") => {
                let list = parser.value()?.string()?;
                let names = list.split(',').filter(|name| !name.is_empty());
                let names = names.map(|name| parse_name("--followers", name));
                out.followers = names.collect::<Result<_, _>>()?;
            }
            Long("set") => out.parameters.push(parameter(&parser.value()?.string()?)?),
            Long("active") if description.managed => out.active = true,
            Long("active") => {
                let name = description.name;
                return Err(format!(
                    "--active: {name} is not managed; write `lifecycle managed;` in its .cdsl and generate it again"
                )
                .into());
            }
            Long("record") => out.record = Some(parser.value()?.into()),
            Long("keep-free") => out.keep_free = Some(mebibytes(&parser.value()?.string()?)?),
            Long("replay") => replay = true,
            Long("check") => check = true,
            Long("probe") => probe = true,
            Long("wait") => wait = Some(seconds(&parser.value()?.string()?)?),
            Long("help") | Short('h') => return Ok(Task::Print(help(description))),
            Long("version") | Short('V') => return Ok(Task::Print(version(description))),
            other => {
                let near = nearest_option(description, &other);
                return Err(format!("{}; {near}see --help", other.unexpected()).into());
            }
        }
    }
    for (middleware, option, given) in of_nodes {
        let read = node_arguments(description, middleware, option, given)?;
        if out.node.replace(read).is_some() {
            return Err(format!("{option}: the arguments are those of one middleware").into());
        }
    }
    if let Some(schema_text) = schema_text {
        out.schema = schema(description, &schema_text)?;
    }
    if out.keep_free.is_some() && out.record.is_none() {
        return Err("--keep-free goes with --record".into());
    }
    if wait.is_some() && !probe {
        return Err("--wait goes with --probe".into());
    }
    Ok(if probe {
        Task::Probe(out, wait.unwrap_or_default())
    } else if check {
        Task::Check(out)
    } else if replay {
        Task::Replay(out)
    } else {
        Task::Run(out)
    })
}

/// Parses a number of MiB, in bytes.
fn mebibytes(text: &str) -> Result<u64, lexopt::Error> {
    let mib: Option<u64> = text.parse().ok();
    let bytes = mib.and_then(|mib| mib.checked_mul(1 << 20));
    let wrong = || format!("--keep-free takes a whole number of MiB, not `{text}`");
    Ok(bytes.ok_or_else(wrong)?)
}

/// Arguments of the nodes of a middleware, with the option that began them.
type OfNodes = (Middleware, &'static str, Vec<OsString>);

/// Splits the command line into the component's own arguments and those of nodes, `--ros-args … --`.
fn split(args: impl IntoIterator<Item = OsString>) -> (Vec<OsString>, Vec<OfNodes>) {
    let (mut own, mut of_nodes) = (Vec::new(), Vec::<OfNodes>::new());
    // The middleware whose arguments follow.
    let mut inside = None;
    for arg in args {
        let begins = Middleware::ALL.into_iter().find_map(|middleware| {
            let option = middleware.can().node_arguments?;
            (arg == option).then_some((middleware, option))
        });
        if let Some((middleware, option)) = begins {
            let known = of_nodes.iter().position(|(of, ..)| *of == middleware);
            inside = known.or_else(|| {
                of_nodes.push((middleware, option, Vec::new()));
                Some(of_nodes.len() - 1)
            });
        } else if inside.is_some() && arg == "--" {
            inside = None;
        } else {
            let list = inside.map_or(&mut own, |at| &mut of_nodes[at].2);
            list.push(arg);
        }
    }
    (own, of_nodes)
}

/// Parses the arguments of nodes, for which the component must be linked with their middleware.
fn node_arguments(
    description: &Description,
    middleware: Middleware,
    option: &str,
    given: Vec<OsString>,
) -> Result<(&'static str, Arc<dyn GivenArguments>), lexopt::Error> {
    let word = middleware.word();
    let mut backends = description.backends.iter();
    let linked = backends.find(|linked| linked.name == word);
    let Some(arguments) = linked.and_then(|linked| linked.arguments) else {
        return Err(format!(
            "{option} is for components that use {word}, and {} does not; generate it with --middleware {word}, or see --help",
            description.name
        )
        .into());
    };
    let text = |arg: OsString| {
        let wrong = |arg: OsString| format!("{option}: `{}` is not UTF-8", arg.to_string_lossy());
        arg.into_string().map_err(wrong)
    };
    let given = given.into_iter().map(text).collect::<Result<_, _>>()?;
    Ok((word, (arguments.read)(given)?))
}

fn seconds(text: &str) -> Result<Duration, lexopt::Error> {
    let seconds = text.parse().ok().filter(|s| *s <= LONGEST_WAIT);
    let wrong = || format!("--wait takes whole seconds, at most {LONGEST_WAIT}, not `{text}`");
    Ok(Duration::from_secs(seconds.ok_or_else(wrong)?))
}

fn parse_name(option: &str, text: &str) -> Result<String, lexopt::Error> {
    // `rcdeploy.sock` is the socket of the supervisor.
    if text == "rcdeploy" || text.starts_with("rcdeploy-") {
        return Err(format!("{option}: the name `{text}` is reserved for rcdeploy").into());
    }
    match Address::parse(text) {
        Ok(address) if !address.as_str().contains('/') => Ok(text.to_owned()),
        _ => {
            Err(format!("{option}: `{text}` is not a name of letters, digits, `_` and `-`").into())
        }
    }
}

fn binding(description: &Description, text: &str) -> Result<(String, Address), lexopt::Error> {
    let Some((slot, address)) = text.split_once('=') else {
        return Err(format!(
            "--bind takes SLOT=ADDRESS, as in `--bind Laser=default/Laser`, not `{text}`"
        )
        .into());
    };
    let slot = check_slot(description, slot)?;
    Ok((slot, Address::parse(address)?))
}

/// Parses `Laser=iceoryx2,local`.
fn transports(
    description: &Description,
    text: &str,
) -> Result<(String, Vec<&'static str>), lexopt::Error> {
    let Some((slot, list)) = text.split_once('=') else {
        return Err(format!(
            "--transport takes SLOT=MIDDLEWARES, as in `--transport Laser=iceoryx2,local`, not `{text}`"
        )
        .into());
    };
    let slot = check_slot(description, slot)?;
    let linked = description.backends.iter().map(|linked| linked.name);
    let mut transports = Vec::new();
    for word in list.split(',') {
        let Some(name) = linked.clone().find(|name| *name == word) else {
            let known = linked.collect::<Vec<_>>().join(", ");
            let name = description.name;
            return Err(format!(
                "--transport: {name} was generated without `{word}`; its middlewares are: {known}"
            )
            .into());
        };
        if !transports.contains(&name) {
            transports.push(name);
        }
    }
    let array = member::split(&slot).map_or(slot.as_str(), |(array, _)| array);
    let mut slots = description.slots.iter();
    let consumes = slots
        .any(|own| own.name == array && matches!(own.role, Role::Requires | Role::SubscribesTo));
    if consumes && transports.len() > 1 {
        return Err(format!(
            "--transport: `{slot}` is a consumer, which has one middleware; the other end has several"
        )
        .into());
    }
    Ok((slot, transports))
}

/// The slot of a subscriber, for `--reliable`.
fn subscriber(description: &Description, slot: &str) -> Result<String, lexopt::Error> {
    let slot = check_slot(description, slot)?;
    let own = member::split(&slot).map_or(slot.as_str(), |(array, _)| array);
    let mut slots = description.slots.iter();
    if slots.any(|of| of.name == own && of.role == Role::SubscribesTo) {
        Ok(slot)
    } else {
        Err(format!("--reliable takes slots that subscribe, and `{slot}` does not").into())
    }
}

/// Parses `Laser=0i:f{1/1000}`.
fn conversion(description: &Description, text: &str) -> Result<(String, String), lexopt::Error> {
    let Some((slot, plan)) = text.split_once('=') else {
        return Err("--convert takes SLOT=PLAN, as `rcdeploy plan --format json` prints it".into());
    };
    let slot = check_slot(description, slot)?;
    let array = member::split(&slot).map_or(slot.as_str(), |(array, _)| array);
    let mut slots = description.slots.iter();
    let consumes = slots
        .any(|own| own.name == array && matches!(own.role, Role::Requires | Role::SubscribesTo));
    if !consumes {
        let message = format!(
            "--convert: `{slot}` sends values; the component that receives them converts them"
        );
        return Err(message.into());
    }
    let Some(converter) = description.converter else {
        return Err(
            "--convert: this program has no conversions: generate the component again".into(),
        );
    };
    let checked = (converter.check)(plan);
    checked.map_err(|error| format!("--convert: `{slot}` has no plan: {error}"))?;
    Ok((slot, plan.to_owned()))
}

/// Parses `lidar=tree`, or `lidar=tf,tf_static`.
fn frames(description: &Description, text: &str) -> Result<(String, String), lexopt::Error> {
    let Some((slot, tree)) = text.split_once('=') else {
        return Err("--frames takes SLOT=TREE, as in `--frames lidar=tree`".into());
    };
    for name in tree.split(',') {
        check_slot(description, name)?;
    }
    Ok((check_slot(description, slot)?, tree.to_owned()))
}

/// Parses `lidar=front.Scans,back.Scans`, as a text for people.
fn providers(description: &Description, text: &str) -> Result<(String, String), lexopt::Error> {
    let Some((slot, names)) = text.split_once('=') else {
        return Err("--providers takes SLOT=NAMES, as in `--providers lidar=front.Scans`".into());
    };
    let names = foreign::clean(names).replace(',', "` or `");
    Ok((check_slot(description, slot)?, names))
}

/// Parses `[["home.gdsl", "Domain home { … };"]]`, the parts of all options together.
fn schema(description: &Description, text: &str) -> Result<Files, lexopt::Error> {
    let mut slots = description.slots.iter();
    if slots.all(|slot| slot.type_name != rc_vocabulary::WORLD_SLOTS[0].type_name) {
        return Err(format!("--schema: {} shares no world", description.name).into());
    }
    let files: Result<Files, _> = serde_json::from_str(text);
    let wrong = "--schema takes FILES, as `rcdeploy plan --format json` prints them";
    Ok(files.map_err(|error| format!("{wrong}: {error}"))?)
}

/// Parses `lasers=front,back`. A list may be empty.
fn members(description: &Description, text: &str) -> Result<(String, Vec<String>), lexopt::Error> {
    let Some((array, list)) = text.split_once('=') else {
        return Err(format!(
            "--members takes ARRAY=NAMES, as in `--members lasers=front,back`, not `{text}`"
        )
        .into());
    };
    let mut arrays = description.slots.iter().filter(|slot| slot.is_array);
    if arrays.clone().all(|slot| slot.name != array) {
        let names: Vec<&str> = arrays.by_ref().map(|slot| slot.name).collect();
        let hint = match rc_diagnostics::nearest(array, names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if names.is_empty() => "it has none".to_owned(),
            None => format!("there are: {}", names.join(", ")),
        };
        let name = description.name;
        return Err(format!("--members: `{array}` is not a slot array of {name}; {hint}").into());
    }
    let mut members: Vec<String> = Vec::new();
    for name in list.split(',').filter(|name| !name.is_empty()) {
        member::check(name).map_err(|reason| format!("--members: `{name}`: {reason}"))?;
        if members.iter().any(|other| other.eq_ignore_ascii_case(name)) {
            return Err(format!("--members: `{array}` has `{name}` twice").into());
        }
        members.push(name.to_owned());
    }
    if members.len() > member::MOST {
        let most = member::MOST;
        return Err(format!("--members: an array has at most {most} members").into());
    }
    Ok((array.to_owned(), members))
}

/// Parses `speed=300`.
fn parameter(text: &str) -> Result<(String, String), lexopt::Error> {
    let Some((path, value)) = text.split_once('=') else {
        let message = format!("--set takes PATH=VALUE, as in `--set speed=300`, not `{text}`");
        return Err(message.into());
    };
    Ok((path.to_owned(), value.to_owned()))
}

/// Parses `dds.domain=7`. The last value of a key counts.
fn setting(text: &str, settings: &mut Settings) -> Result<(), lexopt::Error> {
    let parts = text
        .split_once('=')
        .and_then(|(path, value)| Some((path.split_once('.')?, value)));
    let Some(((middleware, name), value)) = parts else {
        return Err(format!(
            "--set-middleware takes MIDDLEWARE.KEY=VALUE, as in `--set-middleware dds.domain=7`, not `{text}`"
        )
        .into());
    };
    if rc_vocabulary::keys(middleware).is_none() {
        let names = rc_vocabulary::Middleware::words();
        let hint = match rc_diagnostics::nearest(middleware, names.clone()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", names.collect::<Vec<_>>().join(", ")),
        };
        return Err(format!("--set-middleware: `{middleware}` is not a middleware; {hint}").into());
    }
    let Some(key) = rc_vocabulary::key(middleware, name) else {
        return Err(format!(
            "--set-middleware: `{name}` cannot be set of {middleware}; {}",
            rc_vocabulary::unknown_key_help(middleware, name)
        )
        .into());
    };
    let value = key.kind.parse(value).map_err(|_| {
        let each = if key.kind.is_list() { ", each " } else { "" };
        let list = if key.kind.is_list() {
            "a list with commas"
        } else {
            ""
        };
        format!(
            "--set-middleware: {middleware}.{name} cannot be `{value}`; allowed is {list}{each}{}",
            key.kind.allowed()
        )
    })?;
    settings.set(middleware, name, value);
    Ok(())
}

fn array_name(slot: &Slot) -> String {
    let name = slot.name;
    if slot.is_array {
        format!("{name}[]")
    } else {
        name.to_owned()
    }
}

fn version(description: &Description) -> String {
    let Description {
        name,
        model_hash,
        middleware,
        ..
    } = description;
    format!("{name} (model {model_hash:016x}, {middleware})\n")
}

/// Names the option of the help that is most like an unknown one.
fn nearest_option(description: &Description, unknown: &lexopt::Arg<'_>) -> String {
    let Long(unknown) = unknown else {
        return String::new();
    };
    let help = help(description);
    let options = help.split_whitespace();
    let options = options.filter_map(|word| word.strip_prefix("--"));
    let options = options.map(|word| word.trim_end_matches([',', ':']));
    let near = rc_diagnostics::nearest(unknown, options);
    near.map_or_else(String::new, |near| format!("did you mean `--{near}`? "))
}

fn help(description: &Description) -> String {
    let name = description.name;
    let mut out = format!(
        "{name}, a component\n\nUsage: {name} [OPTIONS]\n\nOptions:\n  \
         --config FILE         configuration (default: etc/config.toml here or in the component's folder)\n  \
         --network NAME        network of the component (default: default)\n  \
         --name NAME           name of the component in its network (default: {name})\n  \
         --bind SLOT=ADDRESS   address of a slot (default: NETWORK/Interface)\n  \
         --transport SLOT=MIDDLEWARES\n                        \
         middlewares of a slot, with commas, as `middleware auto;` chooses them; one that serves or publishes may have several\n  \
         --reliable SLOTS      slots, with commas, whose samples are sent again until they arrive, as in lockstep between hosts\n  \
         --members ARRAY=NAMES members of a slot array that the worker has to open, as in `--members lasers=front,back`\n  \
         --convert SLOT=PLAN   units that a slot converts, as `bind … {{ convert; }};` has them\n  \
         --frames SLOT=TREE    the slot of an InnerModel, those of tf, or the world, that know where the frames of these values are\n  \
         --providers SLOT=NAMES\n                        \
         who sends what a slot converts, for the log\n  \
         --schema FILES        names and texts of the schema of the shared world, if it has more than that of the component (JSON);\n                        \
         a long text in parts, each with --schema\n  \
         --set PATH=VALUE      parameter for this run, as in `--set speed=300`\n  \
         --set-middleware MIDDLEWARE.KEY=VALUE\n                        \
         setting of [middleware.MIDDLEWARE], as in dds.domain=7; commas separate a list\n  \
         --clock CLOCK         where time comes from: system, simulated (a component of the network publishes it),\n                        \
         simulated:MIDDLEWARE (heard over this one), source (this component publishes it)\n  \
         --followers NAMES     with --clock source: the components that a tick waits for, in their order, with commas\n  \
         --log LEVEL           error, warn, info, debug or trace (default: info)\n  \
         --record FILE         write an exact recording of this run (MCAP), which `rcdeploy replay` repeats\n  \
         --keep-free MIB       with --record: how much of the disk stays free; the recording ends before (default: a twentieth\n                        \
         of the disk, at most 2048)\n  \
         --replay              repeat the exact recording that `rcdeploy replay` writes to standard input\n  \
         --check               check the configuration and exit\n  \
         --probe               ask the running component of this --network and --name: exit code 0 if it is ready,\n                        \
         1 if it starts, stops, hangs or does not answer in 2 s, 3 if it does not run\n  \
         --wait SECONDS        with --probe: wait until it is ready, at most this long\n  \
         --help, --version\n\nExit codes: 0 success, 1 wrong configuration, 2 wrong usage, 3 the system refused or the worker failed\n"
    );
    if description.managed {
        out.push_str(
            "\nIts life cycle is managed: it starts unconfigured, and `rcdeploy activate NETWORK NAME` or a tool of a middleware\n\
             configures and activates it.\n  \
             --active              configure and activate it at the start; without success it ends with exit code 3\n",
        );
    }
    for arguments in description.backends.iter().filter_map(|b| b.arguments) {
        out.push_str(arguments.help);
    }
    if !description.slots.is_empty() {
        out.push_str("\nSlots:\n");
    }
    for slot in description.slots {
        out.push_str(&format!(
            "  {:<24} {} {} ({})\n",
            array_name(slot),
            slot.role.word(),
            slot.type_name,
            slot.backend
        ));
    }
    let backends = description.backends.iter().map(|linked| linked.name);
    let settings = backends.flat_map(|name| {
        let keys = rc_vocabulary::keys(name).unwrap_or_default();
        keys.iter()
            .map(move |key| (format!("{name}.{}", key.name), key))
    });
    for (at, (path, key)) in settings.enumerate() {
        if at == 0 {
            out.push_str("\nSettings:\n");
        }
        let default = key.default.as_ref();
        let default = default.map_or(String::new(), |d| format!(" (default: {d})"));
        out.push_str(&format!("  {path:<24} {}{default}\n", key.doc));
    }
    out
}
