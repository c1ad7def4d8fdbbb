//! Values by description and values by generated code have the same bytes, for every type of the
//! crate `interfaces`, as CDR and as memory image.

use arbtest::arbitrary::{Result, Unstructured};
use arbtest::arbtest;
use rc_middleware::in_place::{self, InPlace};
use rc_middleware::{Cdr, Encoding, Reader, Writer};
use rc_values::description::Module;
use rc_values::{
    Catalog, Member, Named, Number, Numbers, Primitive, Range, Struct, Type, Value, check_image,
    decode, decode_image, default, encode_body, encode_image, from_json,
};
use std::sync::Arc;

const MODULES: &[&str] = &[
    interfaces::rc_bench::RC_DESCRIPTION,
    interfaces::rc_interop::RC_DESCRIPTION,
    interfaces::rc_soak::RC_DESCRIPTION,
    interfaces::robo_comp_camera::RC_DESCRIPTION,
    interfaces::robo_comp_common_behavior::RC_DESCRIPTION,
    interfaces::robo_comp_differential_robot::RC_DESCRIPTION,
    interfaces::robo_comp_full_pose_estimation::RC_DESCRIPTION,
    interfaces::robo_comp_full_pose_estimation_pub::RC_DESCRIPTION,
    interfaces::robo_comp_generic_base::RC_DESCRIPTION,
    interfaces::robo_comp_joint_motor::RC_DESCRIPTION,
    interfaces::robo_comp_laser::RC_DESCRIPTION,
    interfaces::robo_comp_laser_pub::RC_DESCRIPTION,
    interfaces::robo_comp_speech::RC_DESCRIPTION,
    interfaces::transforms::RC_DESCRIPTION,
];

fn catalog() -> Catalog {
    let modules = MODULES.iter().map(|text| serde_json::from_str(text));
    let modules: Vec<Module> = modules.collect::<Result<_, _>>().expect("descriptions");
    Catalog::new(&modules).expect("a catalog")
}

fn structure(catalog: &Catalog, name: &str) -> Arc<Struct> {
    match catalog.named(name) {
        Some(Type::Named(Named::Struct(found))) => Arc::clone(found),
        other => panic!("{name}: {other:?}"),
    }
}

/// Any value of a type, with short sequences.
fn any(ty: &Type, u: &mut Unstructured<'_>) -> Result<Value> {
    Ok(match ty {
        Type::Primitive(primitive) => number(*primitive, None, u)?,
        Type::Text { bound } => {
            let text: String = u.arbitrary()?;
            let most = bound.map_or(6, |bound| bound as usize).min(6);
            let mut text = text.replace('\0', "");
            while text.len() > most {
                text.pop();
            }
            Value::Text(text)
        }
        Type::Sequence { element, bound } => {
            let most = bound.unwrap_or(3).min(3);
            let length = u.int_in_range(0..=most)?;
            elements(element, length, u)?
        }
        Type::Array { element, length } => elements(element, *length, u)?,
        Type::Dictionary { key, value } => {
            let mut pairs: Vec<(Value, Value)> = Vec::new();
            for _ in 0..u.int_in_range(0..=2)? {
                pairs.push((any(key, u)?, any(value, u)?));
            }
            // Generated code sorts the keys.
            pairs.sort_by_key(|(key, _)| key.plain());
            pairs.dedup_by_key(|(key, _)| key.plain());
            Value::Map(pairs)
        }
        Type::Named(Named::Enum(of)) => {
            let (_, number) = u.choose(&of.values)?;
            Value::Enum(Arc::clone(of), *number)
        }
        Type::Named(Named::Struct(of)) => any_of(of, u)?,
    })
}

fn any_of(of: &Arc<Struct>, u: &mut Unstructured<'_>) -> Result<Value> {
    let mut values = Vec::new();
    for member in &of.members {
        values.push(any_member(member, u)?);
    }
    Ok(Value::Struct(Arc::clone(of), values))
}

fn any_member(member: &Member, u: &mut Unstructured<'_>) -> Result<Value> {
    if member.optional && u.arbitrary()? {
        return Ok(Value::Missing);
    }
    match &member.ty {
        Type::Primitive(primitive) => number(*primitive, Some(member), u),
        ty => any(ty, u),
    }
}

fn elements(element: &Type, length: u32, u: &mut Unstructured<'_>) -> Result<Value> {
    let mut items = Vec::new();
    for _ in 0..length {
        items.push(any(element, u)?);
    }
    let Type::Primitive(primitive) = element else {
        return Ok(Value::Sequence(items));
    };
    let items: Vec<serde_json::Value> = items
        .iter()
        .map(|item| serde_json::to_value(item).expect("JSON"))
        .collect();
    let json = serde_json::json!({"all": items});
    let module: Module = serde_json::from_value(serde_json::json!({"module": "M", "types": [
        {"name": "S", "struct": [{"name": "all", "type": format!("sequence<{}>", primitive.word())}]}]})).expect("a module");
    let catalog = Catalog::new(&[module]).expect("a catalog");
    let value = from_json(&structure(&catalog, "M::S"), &json).expect("numbers");
    Ok(value.field("all").expect("the member"))
}

fn number(
    primitive: Primitive,
    member: Option<&Member>,
    u: &mut Unstructured<'_>,
) -> Result<Value> {
    let range = member.and_then(|member| member.range);
    let low = range.and_then(|range| range.min.map(rc_values::Number::as_float));
    let low = low.unwrap_or(0.0);
    let value = range.map(|_| low).map_or_else(|| u.arbitrary(), Ok)?;
    Ok(match primitive {
        Primitive::Bool => Value::Bool(u.arbitrary()?),
        Primitive::U64 => Value::Uint(u.arbitrary()?),
        Primitive::F32 => Value::F32(if f64::is_finite(value) {
            value as f32
        } else {
            1.5
        })
        .finite(),
        Primitive::F64 => Value::F64(if value.is_finite() { value } else { -2.5 }),
        _ => {
            let (min, max) = primitive.limits().expect("an integer");
            Value::Int(match range {
                Some(_) => low as i64,
                None => u.int_in_range(min as i64..=max as i64)?,
            })
        }
    })
}

trait Finite {
    fn finite(self) -> Self;
}

impl Finite for Value {
    fn finite(self) -> Self {
        match self {
            Self::F32(value) if !value.is_finite() => Self::F32(1.5),
            other => other,
        }
    }
}

/// The generated code reads what the description wrote, and writes the same again.
fn agrees<T: Cdr + Default>(catalog: &Catalog, name: &str) {
    let ty = structure(catalog, name);
    let mut writer = Writer::default();
    writer.put(&T::default());
    if let Ok(bytes) = writer.finish() {
        let value = default(&ty).expect("defaults");
        assert_eq!(
            encode_body(&value).as_deref(),
            Ok(bytes),
            "the default of {name}"
        );
    }
    arbtest(|u| {
        let value = any_of(&ty, u)?;
        let bytes = encode_body(&value).unwrap_or_else(|e| panic!("{name}: {e}: {value:?}"));
        let generated: T = Reader::new(&bytes)
            .get()
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut writer = Writer::default();
        writer.put(&generated);
        assert_eq!(writer.finish(), Ok(bytes.as_slice()), "{name}");
        let back = decode(&ty, Encoding::Cdr, &bytes).expect("our own bytes");
        assert_eq!(back, value, "{name}");
        let json = serde_json::to_value(&value).expect("JSON");
        let read = from_json(&ty, &json).unwrap_or_else(|e| panic!("{name}: {e}: {json}"));
        assert_eq!(
            encode_body(&read).as_deref(),
            Ok(bytes.as_slice()),
            "{name}"
        );
        assert!(!value.text(&rc_values::Style::default()).is_empty());
        Ok(())
    })
    .budget_ms(150);
}

/// Memory images of random values are read and written as the generated code does it.
fn agrees_in_place<T: InPlace>(catalog: &Catalog, name: &str) {
    let ty = structure(catalog, name);
    let size = ty.layout.expect("an image").size;
    assert_eq!(size, size_of::<T>(), "{name}");
    arbtest(|u| {
        let value = any_of(&ty, u)?;
        let image = encode_image(&value).expect("an image");
        let mut placed = in_place::boxed::<T>().expect("memory");
        placed.as_mut_bytes().copy_from_slice(&image);
        let generated = placed.value().unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut writer = Writer::default();
        writer.put(&generated);
        let bytes = encode_body(&value).expect("bytes");
        assert_eq!(writer.finish(), Ok(bytes.as_slice()), "{name}");
        let mut placed = in_place::boxed::<T>().expect("memory");
        placed.set(&generated).expect("it fits");
        let back = decode_image(&ty, placed.as_bytes()).expect("an image");
        assert_eq!(back, value, "{name}");
        assert_eq!(check_image(&ty, placed.as_bytes()), Ok(()), "{name}");
        Ok(())
    })
    .budget_ms(150);
}

macro_rules! check {
    ($check:ident, $catalog:expr, $($name:literal $ty:ty;)*) => {{
        $($check::<$ty>($catalog, $name);)*
        vec![$($name),*]
    }};
}

#[test]
fn every_type_has_the_bytes_of_generated_code() {
    let catalog = catalog();
    let checked = check!(agrees, &catalog,
        "RcBench::Picture" interfaces::rc_bench::Picture;
        "RcBench::Point" interfaces::rc_bench::Point;
        "RcInterop::Point" interfaces::rc_interop::Point;
        "RcInterop::Mark" interfaces::rc_interop::Mark;
        "RcInterop::Report" interfaces::rc_interop::Report;
        "RcInterop::Nonsense" interfaces::rc_interop::Nonsense;
        "RcInterop::Time" interfaces::rc_interop::Time;
        "RcInterop::Header" interfaces::rc_interop::Header;
        "RcInterop::RegionOfInterest" interfaces::rc_interop::RegionOfInterest;
        "RcInterop::CameraInfo" interfaces::rc_interop::CameraInfo;
        "RcInterop::Image" interfaces::rc_interop::Image;
        "RcSoak::Image" interfaces::rc_soak::Image;
        "RoboCompCamera::Image" interfaces::robo_comp_camera::Image;
        "RoboCompCamera::CloudPoint" interfaces::robo_comp_camera::CloudPoint;
        "RoboCompCamera::Cloud" interfaces::robo_comp_camera::Cloud;
        "RoboCompCommonBehavior::Parameter" interfaces::robo_comp_common_behavior::Parameter;
        "RoboCompDifferentialRobot::TMechParams" interfaces::robo_comp_differential_robot::TMechParams;
        "RoboCompFullPoseEstimation::FullPoseEuler" interfaces::robo_comp_full_pose_estimation::FullPoseEuler;
        "RoboCompGenericBase::HardwareFailedException" interfaces::robo_comp_generic_base::HardwareFailedException;
        "RoboCompGenericBase::TBaseState" interfaces::robo_comp_generic_base::TBaseState;
        "RoboCompJointMotor::HardwareFailedException" interfaces::robo_comp_joint_motor::HardwareFailedException;
        "RoboCompJointMotor::OutOfRangeException" interfaces::robo_comp_joint_motor::OutOfRangeException;
        "RoboCompJointMotor::UnknownMotorException" interfaces::robo_comp_joint_motor::UnknownMotorException;
        "RoboCompJointMotor::MotorState" interfaces::robo_comp_joint_motor::MotorState;
        "RoboCompJointMotor::MotorParams" interfaces::robo_comp_joint_motor::MotorParams;
        "RoboCompJointMotor::BusParams" interfaces::robo_comp_joint_motor::BusParams;
        "RoboCompJointMotor::MotorGoalPosition" interfaces::robo_comp_joint_motor::MotorGoalPosition;
        "RoboCompJointMotor::MotorGoalVelocity" interfaces::robo_comp_joint_motor::MotorGoalVelocity;
        "RoboCompLaser::LaserConfData" interfaces::robo_comp_laser::LaserConfData;
        "RoboCompLaser::TData" interfaces::robo_comp_laser::TData;
        "RoboCompSpeech::Datasayin" interfaces::robo_comp_speech::Datasayin;
        "RoboCompSpeech::DataenableSynchronizationin" interfaces::robo_comp_speech::DataenableSynchronizationin;
        "RoboCompSpeech::Dataresponse" interfaces::robo_comp_speech::Dataresponse;
        "Transforms::Time" interfaces::transforms::Time;
        "Transforms::Header" interfaces::transforms::Header;
        "Transforms::Vector3" interfaces::transforms::Vector3;
        "Transforms::Quaternion" interfaces::transforms::Quaternion;
        "Transforms::Transform" interfaces::transforms::Transform;
        "Transforms::TransformStamped" interfaces::transforms::TransformStamped;
    );
    let all = catalog
        .types()
        .filter(|(_, ty)| matches!(ty, Type::Named(Named::Struct(_))));
    // An alias of a structure has the name of another type.
    for (name, ty) in all {
        let is_alias = ty.to_string() != name;
        assert!(
            is_alias || checked.contains(&name),
            "{name} is not in the list"
        );
    }
    let images = check!(agrees_in_place, &catalog,
        "RcBench::Picture" interfaces::rc_bench::PictureInPlace;
        "RcBench::Point" interfaces::rc_bench::PointInPlace;
        "RcInterop::Point" interfaces::rc_interop::PointInPlace;
        "RcInterop::Time" interfaces::rc_interop::TimeInPlace;
        "RcInterop::RegionOfInterest" interfaces::rc_interop::RegionOfInterestInPlace;
        "RcSoak::Image" interfaces::rc_soak::ImageInPlace;
        "RoboCompCamera::Image" interfaces::robo_comp_camera::ImageInPlace;
        "RoboCompCamera::CloudPoint" interfaces::robo_comp_camera::CloudPointInPlace;
        "RoboCompCamera::Cloud" interfaces::robo_comp_camera::CloudInPlace;
        "RoboCompGenericBase::TBaseState" interfaces::robo_comp_generic_base::TBaseStateInPlace;
        "RoboCompLaser::TData" interfaces::robo_comp_laser::TDataInPlace;
        "RoboCompSpeech::DataenableSynchronizationin" interfaces::robo_comp_speech::DataenableSynchronizationinInPlace;
        "Transforms::Time" interfaces::transforms::TimeInPlace;
        "Transforms::Vector3" interfaces::transforms::Vector3InPlace;
        "Transforms::Quaternion" interfaces::transforms::QuaternionInPlace;
        "Transforms::Transform" interfaces::transforms::TransformInPlace;
    );
    assert!(!images.is_empty());
}

#[test]
fn random_bytes_are_values_or_errors() {
    let catalog = catalog();
    let types: Vec<Arc<Struct>> = catalog
        .types()
        .filter_map(|(_, ty)| match ty {
            Type::Named(Named::Struct(of)) => Some(Arc::clone(of)),
            _ => None,
        })
        .collect();
    arbtest(|u| {
        let ty = u.choose(&types)?;
        let bytes: Vec<u8> = u.arbitrary()?;
        if let Ok(value) = decode(ty, Encoding::Cdr, &bytes) {
            let again = encode_body(&value).expect("a decoded value");
            assert!(decode(ty, Encoding::Cdr, &again).is_ok());
        }
        if let Some(layout) = ty.layout.filter(|layout| layout.size < 4096) {
            let mut image = bytes.clone();
            image.resize(layout.size, 0xff);
            let decoded = decode_image(ty, &image).map(drop);
            assert_eq!(decoded, check_image(ty, &image), "{}", ty.name);
        }
        let _ = decode(ty, Encoding::Image, &bytes);
        Ok(())
    });
}

#[test]
fn random_descriptions_are_catalogs_or_errors() {
    arbtest(|u| {
        let mut text = u.choose(MODULES)?.to_string();
        for _ in 0..u.int_in_range(0..=6)? {
            let at = u.int_in_range(0..=text.len())?;
            if !text.is_char_boundary(at) {
                continue;
            }
            let pieces = [
                "[4294967295]",
                "sequence<",
                ">",
                "RoboCompLaser::TData",
                "0",
                "-1e300",
                "null",
                "\"",
                "}",
                "x",
            ];
            let piece = u.choose(&pieces)?;
            if u.arbitrary()? {
                text.insert_str(at, piece);
            } else {
                text.truncate(at);
            }
        }
        let Ok(module) = serde_json::from_str::<Module>(&text) else {
            return Ok(());
        };
        if let Ok(catalog) = Catalog::new(&[module]) {
            for (_, ty) in catalog.types() {
                if let Type::Named(Named::Struct(of)) = ty {
                    let _ = default(of);
                    let _ = decode(of, Encoding::Cdr, &[0xff; 64]);
                }
            }
        }
        Ok(())
    });
}

#[test]
fn types_that_grow_without_limit_are_refused() {
    let chain = |depth: usize, count: &str| {
        let types: Vec<serde_json::Value> = (0..depth)
            .map(|level| {
                let inner = if level + 1 == depth {
                    "int8".to_owned()
                } else {
                    format!("M::T{}{count}", level + 1)
                };
                serde_json::json!({"name": format!("T{level}"), "struct": [
                    {"name": "a", "type": inner}, {"name": "b", "type": inner}]})
            })
            .collect();
        let module = serde_json::json!({"module": "M", "types": types});
        serde_json::from_value::<Module>(module).expect("a module")
    };
    assert!(Catalog::new(&[chain(1000, "")]).is_err());
    assert!(Catalog::new(&[chain(30, "[4294967295]")]).is_ok());
    for count in ["", "[100000]", "[4294967295]"] {
        let catalog = Catalog::new(&[chain(30, count)]).expect("a catalog");
        let ty = structure(&catalog, "M::T0");
        let error = default(&ty).expect_err("two to the thirtieth members");
        assert!(error.reason.contains("MiB"), "{error}");
        assert!(decode(&ty, Encoding::Cdr, &vec![1; 100_000]).is_err());
    }
    // Each element has a copy of the default.
    let long = serde_json::json!({"module": "M", "types": [
        {"name": "A", "struct": [{"name": "a", "type": "string", "default": "x".repeat(100_000)}]},
        {"name": "B", "struct": [{"name": "b", "type": "M::A[10000]"}]}]});
    let long: Module = serde_json::from_value(long).expect("a module");
    let catalog = Catalog::new(&[long]).expect("a catalog");
    let error = default(&structure(&catalog, "M::B")).expect_err("a gigabyte");
    assert!(error.reason.contains("MiB"), "{error}");
    let own = r#"{"module": "M", "types": [{"name": "A", "struct": [{"name": "a", "type": "sequence<M::A>"}]}]}"#;
    let module: Module = serde_json::from_str(own).expect("a module");
    let error = Catalog::new(&[module]).expect_err("it contains itself");
    assert!(error.to_string().contains("contains itself"), "{error}");
}

#[test]
fn a_structure_with_many_members_is_read_and_one_name_stands_there_once() {
    let of = |last: &str| {
        let names = (0..5_000).map(|at| format!("m{at}"));
        let names = names.chain([last.to_owned()]);
        let members: Vec<serde_json::Value> = names
            .map(|name| serde_json::json!({"name": name, "type": "int8"}))
            .collect();
        let types = serde_json::json!([{"name": "A", "struct": members}]);
        let module = serde_json::json!({"module": "M", "types": types});
        Catalog::new(&[serde_json::from_value::<Module>(module).expect("a module")])
    };
    let catalog = of("last").expect("a catalog");
    let ty = structure(&catalog, "M::A");
    let value = from_json(&ty, &serde_json::json!({"last": 3})).expect("it fits");
    let again = serde_json::to_value(&value).expect("JSON");
    assert_eq!(from_json(&ty, &again), Ok(value));
    let error = of("m7").expect_err("a name stands there twice");
    assert_eq!(
        error.to_string(),
        "the description of `M::A.m7` cannot be used: there are two of them"
    );
}

/// As `f64`, 2^53 + 1 would be 2^53.
#[test]
fn integers_of_64_bits_are_compared_exactly() {
    let module: Module = serde_json::from_value(serde_json::json!({"module": "M", "types": [
        {"name": "S", "struct": [
            {"name": "a", "type": "int64", "range": [-5.0, 9_007_199_254_740_992_i64]},
            {"name": "b", "type": "uint64", "range": [18_446_744_073_709_551_614_u64, null],
                "default": u64::MAX},
            {"name": "c", "type": "float64", "range": [9_007_199_254_740_993_i64, null],
                "default": 1e16}]}]}))
    .expect("a module");
    let printed = serde_json::to_string(&module).expect("JSON");
    assert!(printed.contains("18446744073709551614"), "{printed}");
    let catalog = Catalog::new(&[module]).expect("a catalog");
    let ty = structure(&catalog, "M::S");
    let read = |json: serde_json::Value| from_json(&ty, &json);
    for right in [
        serde_json::json!({"a": 9_007_199_254_740_992_i64}),
        serde_json::json!({"a": -5}),
        serde_json::json!({"b": u64::MAX - 1}),
        // The limit of a float is a float: 2^53, as in generated code.
        serde_json::json!({"c": 9_007_199_254_740_992.0}),
    ] {
        read(right).expect("in the range");
    }
    let wrong = |json| read(json).expect_err("outside").to_string();
    assert_eq!(
        wrong(serde_json::json!({"a": 9_007_199_254_740_993_i64})),
        "`a`: 9007199254740993 is outside its range -5 to 9007199254740992"
    );
    assert_eq!(
        wrong(serde_json::json!({"b": u64::MAX - 2})),
        "`b`: 18446744073709551613 is outside its range at least 18446744073709551614"
    );
    assert_eq!(
        wrong(serde_json::json!({"c": 9_007_199_254_740_991.0})),
        "`c`: 9007199254740991 is outside its range at least 9007199254740992"
    );
}

#[test]
fn nan_is_in_no_range() {
    let end = Some(Number::Float(0.0));
    for (min, max) in [(None, None), (end, None), (None, end)] {
        let range = Range { min, max };
        assert!(range.contains(&Value::F64(0.0)), "{range}");
        assert!(!range.contains(&Value::F64(f64::NAN)), "{range}");
        assert!(!range.contains(&Value::F32(f32::NAN)), "{range}");
    }
}

#[test]
fn errors_name_the_path_and_what_is_allowed() {
    let catalog = catalog();
    let interface = catalog
        .interface("RoboCompFullPoseEstimationPub::FullPoseEstimationPub")
        .expect("the interface");
    let pose = &interface
        .operation("newFullPose")
        .expect("the operation")
        .request;
    let reason = |json: serde_json::Value| from_json(pose, &json).expect_err("wrong").to_string();
    let wrong = reason(serde_json::json!({"pose": {"confidence": 101}}));
    assert_eq!(
        wrong,
        "`pose.confidence`: 101 is outside its range 0 to 100 %"
    );
    let wrong = reason(serde_json::json!({"pose": {"confidense": 1}}));
    assert!(wrong.contains("did you mean `confidence`?"), "{wrong}");
    let wrong = reason(serde_json::json!({"pose": {"x": "far"}}));
    assert_eq!(wrong, "`pose.x`: expected a number, found `\"far\"`");
    let wrong = reason(serde_json::json!({"pose": {"confidence": 5_000_000_000_u64}}));
    assert!(
        wrong.starts_with(
            "`pose.confidence`: expected a whole number from -2147483648 to 2147483647"
        ),
        "{wrong}"
    );
    let value = from_json(
        pose,
        &serde_json::json!({"pose": {"x": 2, "source": "a\u{1b}[2J"}}),
    )
    .expect("it fits");
    assert_eq!(value.field("pose.x"), Ok(Value::F32(2.0)));
    let text = value.text(&rc_values::Style::default());
    assert!(
        text.contains("\n  x: 2 mm\n") && text.contains("a\\u{1b}[2J"),
        "{text}"
    );
    let wrong = value
        .field("pose.confidens")
        .expect_err("unknown")
        .to_string();
    assert!(wrong.contains("did you mean `confidence`?"), "{wrong}");
    assert!(Numbers::empty(Primitive::F32).is_empty());
}
