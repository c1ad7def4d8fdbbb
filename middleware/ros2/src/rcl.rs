//! The parameter services and events of ROS 2 as bytes: the messages of `rcl_interfaces`, and
//! replies to requests.

use crate::services::NodeService;
use rc_middleware::parameters::{Parameter, ParameterEvent, ParameterService, ParameterValue};
use rc_middleware::{Cdr, DecodeError, Reader, Writer};

/// A parameter service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Service {
    Describe,
    GetTypes,
    Get,
    List,
    Set,
    SetAtomically,
}

impl Service {
    pub(crate) const ALL: [Self; 6] = [
        Self::Describe,
        Self::GetTypes,
        Self::Get,
        Self::List,
        Self::Set,
        Self::SetAtomically,
    ];

    /// Name and its type.
    pub(crate) fn names(self) -> NodeService {
        let (name, type_name) = match self {
            Self::Describe => (
                "describe_parameters",
                "rcl_interfaces/srv/DescribeParameters",
            ),
            Self::GetTypes => (
                "get_parameter_types",
                "rcl_interfaces/srv/GetParameterTypes",
            ),
            Self::Get => ("get_parameters", "rcl_interfaces/srv/GetParameters"),
            Self::List => ("list_parameters", "rcl_interfaces/srv/ListParameters"),
            Self::Set => ("set_parameters", "rcl_interfaces/srv/SetParameters"),
            Self::SetAtomically => (
                "set_parameters_atomically",
                "rcl_interfaces/srv/SetParametersAtomically",
            ),
        };
        NodeService { name, type_name }
    }
}

/// `rcl_interfaces/msg/ParameterValue`
#[derive(Clone)]
struct Value(ParameterValue);

/// `rcl_interfaces/msg/ParameterType`
fn type_of(value: &ParameterValue) -> u8 {
    match value {
        ParameterValue::None => 0,
        ParameterValue::Bool(_) => 1,
        ParameterValue::Int(_) => 2,
        ParameterValue::Float(_) => 3,
        ParameterValue::Text(_) => 4,
        ParameterValue::Bools(_) => 6,
        ParameterValue::Ints(_) => 7,
        ParameterValue::Floats(_) => 8,
        ParameterValue::Texts(_) => 9,
    }
}

impl Cdr for Value {
    fn encode(&self, writer: &mut Writer) {
        let value = &self.0;
        writer.put(&type_of(value));
        writer.put(&matches!(value, ParameterValue::Bool(true)));
        writer.put(&match value {
            ParameterValue::Int(value) => *value,
            _ => 0,
        });
        writer.put(&match value {
            ParameterValue::Float(value) => *value,
            _ => 0.0,
        });
        match value {
            ParameterValue::Text(value) => text(value, writer),
            _ => text("", writer),
        }
        // An array of bytes, which no parameter has.
        writer.length(0);
        match value {
            ParameterValue::Bools(values) => writer.put(values),
            _ => writer.length(0),
        }
        match value {
            ParameterValue::Ints(values) => writer.put(values),
            _ => writer.length(0),
        }
        match value {
            ParameterValue::Floats(values) => writer.put(values),
            _ => writer.length(0),
        }
        match value {
            ParameterValue::Texts(values) => {
                writer.length(values.len());
                values.iter().for_each(|value| text(value, writer));
            }
            _ => writer.length(0),
        }
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let ty: u8 = reader.get()?;
        let (choice, int, float) = (reader.get()?, reader.get()?, reader.get()?);
        let words: String = reader.get()?;
        let bytes: Vec<u8> = reader.get()?;
        let (choices, ints, floats) = (reader.get()?, reader.get()?, reader.get()?);
        let texts = reader.get()?;
        Ok(Self(match ty {
            0 => ParameterValue::None,
            1 => ParameterValue::Bool(choice),
            2 => ParameterValue::Int(int),
            3 => ParameterValue::Float(float),
            4 => ParameterValue::Text(words),
            5 => ParameterValue::Ints(bytes.into_iter().map(i64::from).collect()),
            6 => ParameterValue::Bools(choices),
            7 => ParameterValue::Ints(ints),
            8 => ParameterValue::Floats(floats),
            9 => ParameterValue::Texts(texts),
            other => {
                return Err(DecodeError::NoSuchValue {
                    what: "rcl_interfaces/msg/ParameterType",
                    value: other.into(),
                });
            }
        }))
    }
}

/// Writes a text without its zero bytes, which CDR does not allow.
pub(crate) fn text(text: &str, writer: &mut Writer) {
    rc_middleware::cdr::text(&text.replace('\0', " "), writer);
}

/// `rcl_interfaces/msg/Parameter`
#[derive(Clone)]
struct Named(String, ParameterValue);

impl Cdr for Named {
    fn encode(&self, writer: &mut Writer) {
        text(&self.0, writer);
        writer.put(&Value(self.1.clone()));
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let name = reader.get()?;
        let Value(value) = reader.get()?;
        Ok(Self(name, value))
    }
}

/// `rcl_interfaces/msg/ParameterDescriptor`
fn describe(name: &str, known: Option<&Parameter>, writer: &mut Writer) {
    text(name, writer);
    writer.put(&known.map_or(0, |known| type_of(&known.value)));
    text(known.map_or("", |known| &known.doc), writer);
    text(known.map_or("", |known| &known.allowed), writer);
    writer.put(&known.is_some_and(|known| !known.editable));
    // `dynamic_typing`: no parameter changes its type.
    writer.put(&false);
    let range = known.and_then(|known| known.range.as_ref());
    match range {
        Some((ParameterValue::Float(min), ParameterValue::Float(max))) => {
            writer.length(1);
            // Minimum, maximum, and a step of any size.
            writer.put(&[*min, *max, 0.0]);
            writer.length(0);
        }
        Some((ParameterValue::Int(min), ParameterValue::Int(max))) => {
            writer.length(0);
            writer.length(1);
            writer.put(&[*min, *max, 0]);
        }
        _ => {
            writer.length(0);
            writer.length(0);
        }
    }
}

/// `builtin_interfaces/msg/Time` of a time in nanoseconds since 1970.
pub(crate) fn put_time(stamp: i64, writer: &mut Writer) {
    const SECOND: i64 = 1_000_000_000;
    writer.put(&i32::try_from(stamp.div_euclid(SECOND)).unwrap_or(i32::MAX));
    writer.put(&(stamp.rem_euclid(SECOND) as u32));
}

/// `rcl_interfaces/msg/SetParametersResult`
fn result(result: &Result<(), String>, writer: &mut Writer) {
    writer.put(&result.is_ok());
    text(result.as_ref().err().map_or("", String::as_str), writer);
}

/// `rcl_interfaces/msg/ParameterEvent` of the node `node`, at `stamp`, in nanoseconds since 1970.
pub(crate) fn event(stamp: i64, node: &str, event: &ParameterEvent) -> Result<Vec<u8>, String> {
    let mut writer = Writer::default();
    put_time(stamp, &mut writer);
    text(node, &mut writer);
    for parameters in [&event.new, &event.changed] {
        writer.length(parameters.len());
        for Parameter { path, value, .. } in parameters {
            writer.put(&Named(path.clone(), value.clone()));
        }
    }
    // Deleted parameters: none.
    writer.length(0);
    let body = writer.finish().map_err(|error| error.to_string())?;
    Ok(body.to_vec())
}

/// The names with one of `prefixes`, or all names if there is none, and the paths above them. A
/// name has at most `depth` parts after its prefix; 0 allows any number.
fn listed(all: &[Parameter], prefixes: &[String], depth: u64) -> (Vec<String>, Vec<String>) {
    let parts = |text: &str| text.matches('.').count() as u64;
    let is_in = |name: &str| {
        let fits = |prefix: &String| {
            let rest = name.strip_prefix(prefix.as_str());
            let below = rest.and_then(|rest| rest.strip_prefix('.'));
            rest == Some("") || below.is_some_and(|below| depth == 0 || parts(below) < depth)
        };
        if prefixes.is_empty() {
            depth == 0 || parts(name) < depth
        } else {
            prefixes.iter().any(fits)
        }
    };
    let names = all.iter().map(|known| &known.path);
    let names: Vec<String> = names.filter(|name| is_in(name)).cloned().collect();
    let mut within: Vec<String> = Vec::new();
    for (path, _) in names.iter().filter_map(|name| name.rsplit_once('.')) {
        if !within.iter().any(|known| known == path) {
            within.push(path.to_owned());
        }
    }
    (names, within)
}

/// The body of the reply to a request. It fails if the request cannot be read, or the component
/// does not respond.
pub(crate) fn answer(
    service: Service,
    request: &[u8],
    parameters: &dyn ParameterService,
) -> Result<Vec<u8>, String> {
    let mut reader = Reader::new(request);
    let wrong = |error: DecodeError| error.to_string();
    let mut writer = Writer::default();
    match service {
        Service::Describe | Service::GetTypes | Service::Get => {
            let names: Vec<String> = reader.get().map_err(wrong)?;
            let all = parameters.list()?;
            writer.length(names.len());
            for name in &names {
                let known = all.iter().find(|known| known.path == *name);
                let value = known.map_or(&ParameterValue::None, |known| &known.value);
                match service {
                    Service::Describe => describe(name, known, &mut writer),
                    Service::GetTypes => writer.put(&type_of(value)),
                    _ => writer.put(&Value(value.clone())),
                }
            }
        }
        Service::List => {
            let prefixes: Vec<String> = reader.get().map_err(wrong)?;
            let depth: u64 = reader.get().map_err(wrong)?;
            let (names, within) = listed(&parameters.list()?, &prefixes, depth);
            writer.put(&names);
            writer.put(&within);
        }
        Service::Set => {
            let wanted: Vec<Named> = reader.get().map_err(wrong)?;
            writer.length(wanted.len());
            for Named(name, value) in wanted {
                result(&parameters.set(&[(name, value)]), &mut writer);
            }
        }
        Service::SetAtomically => {
            let wanted: Vec<Named> = reader.get().map_err(wrong)?;
            let wanted = wanted.into_iter().map(|Named(name, value)| (name, value));
            let wanted: Vec<(String, ParameterValue)> = wanted.collect();
            result(&parameters.set(&wanted), &mut writer);
        }
    }
    let body = writer.finish().map_err(|error| error.to_string())?;
    Ok(body.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::parameters::ParameterListener;

    struct Fixed;

    impl ParameterService for Fixed {
        fn list(&self) -> Result<Vec<Parameter>, String> {
            let paths = ["speed", "arm.joints", "arm.left.max"];
            let parameter = |path: &str| Parameter {
                path: path.to_owned(),
                value: ParameterValue::Float(1.5),
                doc: String::new(),
                allowed: String::new(),
                editable: true,
                range: None,
            };
            Ok(paths.map(parameter).into())
        }

        fn set(&self, _: &[(String, ParameterValue)]) -> Result<(), String> {
            Err("no".to_owned())
        }

        fn watch(&self, _: ParameterListener) {}
    }

    #[test]
    fn prefixes_and_depth_choose() {
        let all = Fixed.list().expect("parameters");
        let names = |prefixes: &[&str], depth| {
            let prefixes: Vec<String> = prefixes.iter().map(|p| (*p).to_owned()).collect();
            listed(&all, &prefixes, depth).0.join(" ")
        };
        assert_eq!(names(&[], 0), "speed arm.joints arm.left.max");
        assert_eq!(names(&[], 1), "speed");
        assert_eq!(names(&[], 2), "speed arm.joints");
        assert_eq!(names(&["arm"], 0), "arm.joints arm.left.max");
        assert_eq!(names(&["arm"], 1), "arm.joints");
        assert_eq!(names(&["arm.left", "speed"], 0), "speed arm.left.max");
        assert_eq!(names(&["ar", "speed.x"], 0), "");
        let (_, within) = listed(&all, &[], 0);
        assert_eq!(within, ["arm", "arm.left"]);
    }

    #[test]
    fn values_come_back() {
        let texts = vec!["a".to_owned(), String::new()];
        for value in [
            ParameterValue::None,
            ParameterValue::Bool(true),
            ParameterValue::Int(-3),
            ParameterValue::Float(0.5),
            ParameterValue::Text("x".to_owned()),
            ParameterValue::Bools(vec![true, false]),
            ParameterValue::Ints(vec![1, 2]),
            ParameterValue::Floats(vec![1.0]),
            ParameterValue::Texts(texts),
        ] {
            let mut writer = Writer::default();
            writer.put(&Named("n".to_owned(), value.clone()));
            let bytes = writer.into_bytes();
            let Named(name, back) = Reader::new(&bytes).get().expect("a parameter");
            assert_eq!((name.as_str(), back), ("n", value));
        }
    }

    #[test]
    fn an_event_has_its_time_its_node_and_three_lists() {
        let told = ParameterEvent {
            new: Vec::new(),
            changed: Fixed.list().expect("parameters"),
        };
        let body = event(1_763_700_000_000_000_007, "/robot/arm", &told).expect("a body");
        let mut reader = Reader::new(&body);
        assert_eq!(reader.get(), Ok(1_763_700_000_i32));
        assert_eq!(reader.get(), Ok(7_u32));
        assert_eq!(reader.get(), Ok("/robot/arm".to_owned()));
        assert_eq!(reader.get(), Ok(0_u32));
        let changed: Vec<Named> = reader.get().expect("what has changed");
        let names: Vec<&str> = changed.iter().map(|named| named.0.as_str()).collect();
        assert_eq!(names, ["speed", "arm.joints", "arm.left.max"]);
        assert!(changed.iter().all(|n| n.1 == ParameterValue::Float(1.5)));
        assert_eq!(reader.get(), Ok(0_u32));
        assert_eq!(reader.rest(), [0; 0]);
    }

    /// Any request gives a reply or an error, and allocates little memory.
    #[test]
    fn hostile_requests_are_errors() {
        let mut wanted = Writer::default();
        wanted.put(&vec![Named("speed".to_owned(), ParameterValue::Float(2.0))]);
        let wanted = wanted.into_bytes();
        let huge = [0xff; 64];
        for service in Service::ALL {
            assert!(answer(service, &[], &Fixed).is_err());
            assert!(answer(service, &huge, &Fixed).is_err());
        }
        for end in 0..wanted.len() {
            assert!(
                answer(Service::Set, &wanted[..end], &Fixed).is_err(),
                "{end}"
            );
            // One byte differs: any reply is allowed.
            let mut spoilt = wanted.clone();
            spoilt[end] ^= 0x55;
            let _ = answer(Service::Set, &spoilt, &Fixed);
        }
        let refused = answer(Service::Set, &wanted, &Fixed).expect("an answer");
        let mut reader = Reader::new(&refused);
        let (count, done): (u32, bool) = (reader.get().expect("1"), reader.get().expect("2"));
        assert_eq!((count, done, reader.get()), (1, false, Ok("no".to_owned())));
    }
}
