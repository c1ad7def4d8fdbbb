//! `rcdeploy replay`: lets a component live again by its exact recording.

use super::networks::network_of;
use super::output::{Failure, print_note, show, system};
use rc_deploy_client::{Format, logs};
use rc_diagnostics::foreign::{clean, clean_to};
use rc_middleware::rpc;
use rc_record::bag::Decoder;
use rc_record::{ENCAPSULATION, Faults, Message, Reader, Record, keys};
use rc_values::description::Module;
use rc_values::{Catalog, Operation, Style, Value};
use serde_json::Value as Json;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};
use std::time::Instant;

/// The longest report of a component, in bytes.
const LONGEST_REPORT: usize = 16 * 1024 * 1024;
/// The most characters of a value that a line shows.
const SHOWN: usize = 400;

/// Arguments of `replay`.
#[derive(clap::Args)]
pub(super) struct Replay {
    /// The recording, or the network whose last recording is meant.
    #[arg(value_name = "FILE.mcap", add = rc_command_line::files(&["mcap"]))]
    file: PathBuf,
    /// The component. Optional if the file holds the life of one.
    component: Option<String>,
    /// The executable, instead of the one that was recorded.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// The configuration, for its secrets: they are not recorded.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Hides the component's own log, and prints only whether the run is the same.
    #[arg(long)]
    check: bool,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = super::arguments::format, add = rc_command_line::words(&["human", "json"]))]
    format: Format,
}

/// The beginning of an exact recording.
struct RecordingStart {
    topic: String,
    name: String,
    start: Json,
}

pub(super) fn replay(options: &Replay) -> Result<u8, Failure> {
    let file = recording(options)?;
    let recording = find(&file, options.component.as_deref())?;
    let said = |key: &str| {
        recording
            .start
            .get(key)
            .and_then(Json::as_str)
            .unwrap_or_default()
    };
    let program = match &options.program {
        Some(program) => std::path::absolute(program).map_err(|e| system(&e))?,
        None => recorded_program(&file, said("program"))?,
    };
    print_note(&format_args!("runs {}", clean(&program.to_string_lossy())));
    let mut command = Command::new(&program);
    if recording.start.get("is_shared") == Some(&Json::Bool(true)) {
        command.args(["--member", said("component")]);
    }
    command.arg("--replay");
    if let Some(config) = &options.config {
        let config = std::path::absolute(config).map_err(|e| system(&e))?;
        command.arg("--config").arg(config);
    }
    if options.check {
        command.args(["--log", "error"]);
    }
    let directory = Path::new(said("directory"));
    if directory.is_dir() {
        command.current_dir(directory);
    }
    let began = Instant::now();
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|e| {
            Failure(
                3,
                format!(
                    "cannot start {}: {e}; name it with --program",
                    program.display()
                ),
            )
        })?;
    let input = child.stdin.take();
    let (path, topic) = (file.clone(), recording.topic.clone());
    let feeder = std::thread::spawn(move || match input {
        Some(input) => feed(&path, &topic, input),
        None => Ok(Faults::default()),
    });
    let output = child.stdout.take();
    let printed = output.map(last_of).transpose();
    let printed = printed.map_err(|e| system(&e))?.unwrap_or_default();
    let status = child.wait().map_err(|e| system(&e))?;
    let cut = feeder.join().unwrap_or(Ok(Faults::default()));
    let printed = String::from_utf8_lossy(&printed);
    let report = printed.lines().rev().find_map(|line| {
        let json: Json = serde_json::from_str(line).ok()?;
        json.get("equal").is_some().then_some(json)
    });
    let Some(report) = report else {
        // It has printed the reason on standard error.
        return Err(Failure(
            3,
            format!("{} ended without a report ({status})", program.display()),
        ));
    };
    let faults = cut?;
    if !faults.is_none() {
        print_note(&format_args!("the recording is incomplete: {faults}"));
    }
    let took = began.elapsed().as_secs_f64();
    let is_equal = report.get("equal") == Some(&Json::Bool(true));
    show(options.format, &report, |report| {
        text(&recording.name, report, took)
    })?;
    Ok(u8::from(!is_equal))
}

/// The program that a recording names. A recording of somebody else may name any program, so only
/// those in the folder of this user's logs are believed.
fn recorded_program(file: &Path, program: &str) -> Result<PathBuf, Failure> {
    let canonical = |path: &Path| path.canonicalize().ok();
    let own = canonical(&logs::root());
    let file = canonical(file);
    if program.is_empty() {
        return Err(Failure(
            2,
            "the recording names no program, as that of a component which `python -m` or `embed` has started; \
             name it with --program"
                .to_owned(),
        ));
    }
    if own
        .zip(file)
        .is_some_and(|(own, file)| file.starts_with(own))
    {
        return Ok(PathBuf::from(program));
    }
    Err(Failure(
        2,
        format!(
            "the recording is not in {}, so the program that it names is not run unasked; \
             if you trust it, add --program {}",
            logs::root().display(),
            clean(program)
        ),
    ))
}

/// Reads to the end, and returns the last bytes: the report comes last.
fn last_of(mut output: impl Read) -> io::Result<Vec<u8>> {
    let (mut kept, mut piece) = (Vec::new(), vec![0; 1 << 16]);
    loop {
        match output.read(&mut piece) {
            Ok(0) => break,
            Ok(count) => kept.extend_from_slice(&piece[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        if kept.len() > 2 * LONGEST_REPORT {
            kept.drain(..kept.len() - LONGEST_REPORT);
        }
    }
    Ok(kept)
}

/// The file that is meant.
fn recording(options: &Replay) -> Result<PathBuf, Failure> {
    if options.file.extension().is_some_and(|e| e == "mcap") {
        return Ok(options.file.clone());
    }
    let network = network_of(&options.file.to_string_lossy())?;
    let folder = logs::directory(&network);
    let mut recorded = components(&folder);
    if let Some(component) = options.component.as_ref().filter(|_| !recorded.is_empty()) {
        let file = folder.join(format!("{component}.exact.mcap"));
        if file.exists() {
            return Ok(file);
        }
        let names: Vec<String> = recorded.iter().map(|(name, _)| clean(name)).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (component, hint) = (clean(component), hint(component, &names));
        return Err(Failure(
            2,
            format!("{network} has no exact recording of `{component}`; {hint}"),
        ));
    }
    match recorded.as_slice() {
        [_] => Ok(recorded.swap_remove(0).1),
        [] => Err(Failure(
            1,
            format!(
                "{} holds no exact recording of {network}; write `record {{ exact; }};` at a component in the .ddsl",
                folder.display()
            ),
        )),
        several => {
            let names: Vec<String> = several.iter().map(|(name, _)| clean(name)).collect();
            let names = names.join(", ");
            Err(Failure(
                2,
                format!("{network} has exact recordings of {names}; name one"),
            ))
        }
    }
}

/// The component with the name next to `name`, or all of them.
fn hint(name: &str, all: &[&str]) -> String {
    match rc_diagnostics::nearest(name, all.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("it has those of {}", all.join(", ")),
    }
}

/// The components with an exact recording in the folder of a network's logs, and its file.
fn components(folder: &Path) -> Vec<(String, PathBuf)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let recorded = entries.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        let component = name.strip_suffix(".exact.mcap")?;
        Some((component.to_owned(), entry.path()))
    });
    let mut recorded: Vec<_> = recorded.collect();
    recorded.sort();
    recorded
}

/// Finds the life of a component in a recording.
fn find(file: &Path, component: Option<&str>) -> Result<RecordingStart, Failure> {
    let mut reader = Reader::open(file)?;
    let mut found: Vec<RecordingStart> = Vec::new();
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        let Some(name) = message.channel.get(keys::EXACT) else {
            continue;
        };
        if found
            .iter()
            .any(|recording| recording.topic == message.channel.topic)
        {
            continue;
        }
        let is_meant = component == Some(name);
        let recording = RecordingStart {
            topic: message.channel.topic.clone(),
            name: clean(name),
            start: start(&message),
        };
        if is_meant {
            return Ok(recording);
        }
        found.push(recording);
    }
    let names: Vec<&str> = found
        .iter()
        .map(|recording| recording.name.as_str())
        .collect();
    let file = file.display();
    match (component, names.as_slice()) {
        (None, [_]) => Ok(found.swap_remove(0)),
        (_, []) => Err(Failure(
            1,
            format!(
                "{file} holds no exact recording; write `record {{ exact; }};` at the component in the .ddsl"
            ),
        )),
        (None, _) => Err(Failure(
            2,
            format!("{file} holds {}; name one", names.join(", ")),
        )),
        (Some(name), _) => {
            let (component, hint) = (clean(name), hint(name, &names));
            Err(Failure(
                1,
                format!("{file} holds no exact recording of `{component}`; {hint}"),
            ))
        }
    }
}

/// The JSON document of the first entry.
fn start(message: &Message) -> Json {
    let turn = Decoder::default().value(message).ok();
    let text = turn.and_then(|turn| turn.field("entries[0].text").ok());
    let document = text.and_then(|text| serde_json::from_str(&text.plain()).ok());
    document.unwrap_or_default()
}

/// Writes the turns of a component to its process. Returns why less was read than was recorded.
fn feed(file: &Path, topic: &str, input: ChildStdin) -> Result<Faults, Failure> {
    let mut input = BufWriter::with_capacity(1 << 16, input);
    let mut reader = Reader::open(file)?;
    let mut write = |data: &[u8]| -> io::Result<()> {
        let body = data.get(ENCAPSULATION.len()..).unwrap_or_default();
        input.write_all(&(body.len() as u32).to_le_bytes())?;
        input.write_all(body)
    };
    while let Some(record) = reader.next() {
        if let Record::Message(message) = record
            && message.channel.topic == topic
            && write(&message.data).is_err()
        {
            // The process has found a difference, or has ended.
            return Ok(Faults::default());
        }
    }
    let _ = input.flush();
    Ok(reader.faults().clone())
}

/// The report for people.
fn text(name: &str, report: &Json, took: f64) -> String {
    let number = |key: &str| report.get(key).and_then(Json::as_u64).unwrap_or_default();
    let time = report
        .get("time_s")
        .and_then(Json::as_f64)
        .unwrap_or_default();
    let (turns, compared) = (number("turns"), number("compared"));
    if let Some(error) = report.get("error").and_then(Json::as_str) {
        return format!("{name}: {}\n", clean(error));
    }
    let Some(difference) = report.get("difference") else {
        return format!(
            "{name}: the run is the same: {turns} turns, {compared} results compared, in {took:.1} s\n"
        );
    };
    let catalog = catalog(report);
    let entry = |key: &str| describe(difference.get(key).unwrap_or(&Json::Null), &catalog);
    // A worker that reads no clock has no time.
    let at = if time > 0.0 {
        format!(", at {time:.3} s")
    } else {
        String::new()
    };
    let mut text = format!(
        "{name}: the run differs in turn {}{at}, after {compared} equal results\n",
        number("turn")
    );
    text += &format!(
        "  recorded  {}\n  now       {}\n",
        entry("recorded"),
        entry("found")
    );
    text += "  before\n";
    let before = difference.get("before").and_then(Json::as_array);
    for one in before.into_iter().flatten() {
        let turn = one.get("turn").and_then(Json::as_u64).unwrap_or_default();
        text += &format!("    {turn:>8}  {}\n", describe(one, &catalog));
    }
    text
}

/// The types of the component, as it describes them.
fn catalog(report: &Json) -> Catalog {
    let types = report.get("types").and_then(Json::as_array);
    let modules = types.into_iter().flatten();
    let modules = modules.filter_map(|one| serde_json::from_str::<Module>(one.as_str()?).ok());
    let modules: Vec<Module> = modules.collect();
    Catalog::new(&modules).unwrap_or_default()
}

/// One line about an entry.
fn describe(entry: &Json, catalog: &Catalog) -> String {
    let word = |key: &str| clean(entry.get(key).and_then(Json::as_str).unwrap_or_default());
    let mut line = word("kind");
    let slot = word("slot");
    if !slot.is_empty() {
        line += &format!(" {slot}");
    }
    let operation = word("operation");
    if !operation.is_empty() {
        line += &format!(".{operation}");
    }
    if let Some(value) = entry.get("value").and_then(Json::as_u64) {
        line += &match line.as_str() {
            "now" => format!(" {:.6} s", value as f64 / 1e9),
            "period" => format!(" {:.3} ms", value as f64 / 1e6),
            _ => format!(" {value}"),
        };
    }
    let text = word("text");
    if !text.is_empty() {
        line += &format!(" {}", clean_to(&text, SHOWN));
    }
    let length = entry.get("length").and_then(Json::as_u64);
    if let Some(length) = length {
        let interface = catalog.interface(&word("interface"));
        let operation = interface.and_then(|interface| interface.operation(&operation));
        let bytes = bytes(&word_raw(entry, "data"));
        let value = operation.and_then(|operation| value(entry, operation, &bytes));
        line += &match value {
            Some(value) => {
                let style = Style {
                    elements: 8,
                    characters: 64,
                };
                let text = value.text(&style);
                let parts: Vec<&str> = text.lines().map(str::trim).collect();
                format!(" {{ {} }}", clean_to(&parts.join(", "), SHOWN))
            }
            None => format!(" {length} bytes {}", clean_to(&word_raw(entry, "data"), 64)),
        };
    }
    line
}

fn word_raw(entry: &Json, key: &str) -> String {
    entry
        .get(key)
        .and_then(Json::as_str)
        .unwrap_or_default()
        .to_owned()
}

fn bytes(hexadecimal: &str) -> Vec<u8> {
    let digits = hexadecimal.as_bytes().chunks_exact(2);
    let bytes = digits.filter_map(|pair| {
        let pair = std::str::from_utf8(pair).ok()?;
        u8::from_str_radix(pair, 16).ok()
    });
    bytes.collect()
}

/// The parameters of a request or a sample.
fn value(entry: &Json, operation: &Operation, bytes: &[u8]) -> Option<Value> {
    let mut reader = rc_middleware::Reader::new(bytes);
    match entry.get("kind")?.as_str()? {
        "call" | "send" | "request" => {
            rpc::open_request(&mut reader).ok()?;
        }
        "publish" | "sample" => {}
        _ => return None,
    }
    rc_values::decode_from(&operation.request, &mut reader).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_record::Channel;
    use std::collections::BTreeMap;
    use std::sync::Arc;

    #[test]
    fn the_components_with_recordings_are_found() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in [
            "b.exact.mcap",
            "b.exact.1.mcap",
            "a.exact.mcap",
            "a.log",
            "rcdeploy-ring-1.mcap",
        ] {
            std::fs::write(folder.path().join(name), "").expect("to write");
        }
        let found = components(folder.path());
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["a", "b"]);
    }

    /// The length of the document before it may have the byte of a brace.
    #[test]
    fn the_first_entry_is_read_also_if_its_length_looks_like_json() {
        let document = format!("{{\"program\":\"{}\"}}", "x".repeat(0x7b - 15));
        assert_eq!(document.len() + 1, 0x7b);
        let mut data = ENCAPSULATION.to_vec();
        let mut writer = rc_middleware::Writer::default();
        writer.length(1);
        rc_middleware::cdr::text(&document, &mut writer);
        data.extend(writer.into_bytes());
        let schema =
            "Entry[] entries\n================\nMSG: robocomp_exact_msgs/Entry\nstring text\n";
        let message = Message {
            channel: Arc::new(Channel {
                id: 1,
                topic: "/net/a/exact".to_owned(),
                encoding: "cdr".to_owned(),
                type_name: "robocomp_exact_msgs/msg/Turn".to_owned(),
                schema_encoding: "ros2msg".to_owned(),
                schema: schema.as_bytes().into(),
                metadata: BTreeMap::new(),
            }),
            sequence: 0,
            log_time: 0,
            publish_time: 0,
            data,
        };
        assert!(start(&message)["program"].is_string());
    }
}
