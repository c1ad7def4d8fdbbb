//! Values of messages as those of another data prototype.

mod change;

use self::change::{Slot, Tree, fields, merged};
use crate::error::RecordError;
use rc_plans::{Network, Program};
use rc_prototypes::model::{Content, Library, Prototype};
use rc_ros_types::words;
use rc_values::{Named, Primitive, Struct, Type, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

/// Converts values into those of a prototype.
///
/// Wherever a message has a structure with a prototype that means the same, the members with its
/// numbers become those of the wanted prototype. Other members stay.
#[derive(Debug)]
pub struct Converter {
    /// The wanted prototype.
    name: String,
    views: Vec<View>,
    /// The changes of structures, by the view and the name of the structure.
    known: Mutex<Known>,
}

/// A prototype that converts into the wanted one.
#[derive(Debug)]
struct View {
    name: String,
    /// The names of its type, with the names that members have there.
    types: Vec<(String, Naming)>,
    program: Program,
    /// The members with its numbers, and those of the wanted prototype with their types.
    from: Vec<String>,
    to: Vec<(String, Primitive, Option<String>)>,
    /// The member whose elements are values.
    sequence: Option<String>,
    /// The members that the result does not have.
    dropped: Vec<String>,
    /// The losses and assumptions of the plan.
    told: Vec<String>,
}

/// The changes of types, by view and address of the type.
type Known = BTreeMap<(usize, usize), (Arc<Struct>, Arc<Change>)>;

/// The most types of which this is known at a time.
const MOST_KNOWN: usize = 4096;

/// Which names the members of a prototype have in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Naming {
    /// Names of the prototype.
    Own,
    /// Names of the definition for ROS 2, as in recordings.
    Ros,
}

/// The change of a structure.
#[derive(Debug)]
struct Change {
    /// Where the numbers are: the numbers of members and elements.
    inputs: Vec<Vec<usize>>,
    ty: Arc<Struct>,
    slots: Vec<Slot>,
}

/// A name of a member in the messages.
fn named(path: &str, naming: Naming) -> Vec<String> {
    let words = path.split('.').map(|word| match naming {
        Naming::Ros if word.parse::<usize>().is_err() => words::field(word),
        Naming::Own | Naming::Ros => word.to_owned(),
    });
    words.collect()
}

/// The names that the type of a prototype has in messages.
fn types(of: &Prototype) -> Vec<(String, Naming)> {
    if let Some(path) = of.interface_type() {
        let (module, name) = path.rsplit_once("::").unwrap_or(("", path));
        let ros = format!("{}::{}", words::package(module), words::ty(name));
        return vec![(path.to_owned(), Naming::Own), (ros, Naming::Ros)];
    }
    match &of.content {
        Content::Values { language, ty, .. } if language.starts_with("ROS") => {
            let ty = ty.replace("/msg/", "/").replace('/', "::");
            vec![(ty, Naming::Own)]
        }
        Content::Values { .. } | Content::Parts(_) => Vec::new(),
    }
}

impl Converter {
    /// Converts into this prototype: values of the prototype `of`, or of each one that means the
    /// same.
    ///
    /// # Errors
    /// A prototype is unknown, nothing converts, or two prototypes are about one type.
    pub fn new(library: &Library, name: &str, of: Option<&str>) -> Result<Self, String> {
        let known = |name: &str| {
            let names = || library.prototypes.iter().map(|of| of.name.as_str());
            library.prototype(name).ok_or_else(|| {
                let near = rc_diagnostics::nearest(name, names());
                let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                format!("the files have no prototype `{name}`{near}")
            })
        };
        let wanted = known(name)?;
        let from: Vec<&Prototype> = match of {
            Some(of) => vec![known(of)?],
            None => library.prototypes.iter().collect(),
        };
        // A message says where the elements of a sequence are: plans are about one of them.
        let elements = library.of_elements();
        let network = Network::new(&elements);
        let mut views: Vec<View> = Vec::new();
        let mut reason = None;
        for own in from.into_iter().filter(|own| own.name != name) {
            let types = types(own);
            if types.is_empty() {
                continue;
            }
            let view = match view(library, &network, own, wanted) {
                Ok(program) => View { types, ..program },
                Err(refusal) => {
                    reason =
                        of.map(|of| format!("`{of}` does not convert into `{name}`: {refusal}"));
                    continue;
                }
            };
            let same = |other: &&View| other.types == view.types && other.sequence == view.sequence;
            if let Some(other) = views.iter().find(same) {
                return Err(format!(
                    "`{}` and `{}` are about one type; choose one with --of",
                    other.name, view.name
                ));
            }
            views.push(view);
        }
        if views.is_empty() {
            let none = || format!("no prototype of a type of messages converts into `{name}`");
            return Err(reason.unwrap_or_else(none));
        }
        Ok(Self {
            name: name.to_owned(),
            views,
            known: Mutex::default(),
        })
    }

    /// The losses and assumptions of the conversions: a sentence for each prototype that has any.
    pub fn losses(&self) -> impl Iterator<Item = String> {
        let told = self.views.iter().filter(|view| !view.told.is_empty());
        told.map(|view| {
            format!(
                "`{}` as `{}`: {}",
                view.name,
                self.name,
                view.told.join("; ")
            )
        })
    }

    /// Whether values of a type have something to convert.
    pub fn converts(&self, ty: &Struct) -> bool {
        self.is_in(ty, &mut BTreeSet::new())
    }

    /// Visits each structure once: it may be reached in several ways.
    fn is_in(&self, ty: &Struct, seen: &mut BTreeSet<String>) -> bool {
        if self.views(ty).next().is_some() {
            return true;
        }
        let is_new = seen.insert(ty.name.clone());
        is_new
            && ty
                .members
                .iter()
                .any(|member| self.is_in_type(&member.ty, seen))
    }

    fn is_in_type(&self, ty: &Type, seen: &mut BTreeSet<String>) -> bool {
        match ty {
            Type::Named(Named::Struct(of)) => self.is_in(of, seen),
            Type::Sequence { element, .. } | Type::Array { element, .. } => {
                self.is_in_type(element, seen)
            }
            Type::Dictionary { value, .. } => self.is_in_type(value, seen),
            Type::Primitive(_) | Type::Text { .. } | Type::Named(Named::Enum(_)) => false,
        }
    }

    /// The prototypes of a type: of the whole, and of the elements of its members.
    fn views(&self, ty: &Struct) -> impl Iterator<Item = (usize, Naming)> {
        self.views.iter().enumerate().filter_map(|(at, view)| {
            let mut types = view.types.iter();
            let (_, naming) = types.find(|(name, _)| *name == ty.name)?;
            Some((at, *naming))
        })
    }

    /// Why a type has nothing to convert, where [`Self::converts`] says no.
    pub fn no_conversion_error(&self, ty: &Struct) -> RecordError {
        let sources: Vec<String> = self
            .views
            .iter()
            .map(|view| format!("`{}`", view.name))
            .collect();
        RecordError::Value(format!(
            "`{}` holds no values of {}, which convert into `{}`",
            ty.name,
            sources.join(" or "),
            self.name
        ))
    }

    /// A value with all its parts converted.
    ///
    /// # Errors
    /// A number is none of its meaning, such as a quaternion of length 0, or the type lacks a
    /// member of the prototype.
    pub fn value(&self, value: Value) -> Result<Value, RecordError> {
        match value {
            Value::Struct(ty, values) => self.structure(ty, values),
            Value::Sequence(items) => {
                let items = items.into_iter().map(|item| self.value(item));
                items.collect::<Result<_, _>>().map(Value::Sequence)
            }
            Value::Map(pairs) => {
                let pairs = pairs.into_iter();
                let pairs = pairs.map(|(key, value)| Ok((key, self.value(value)?)));
                pairs.collect::<Result<_, RecordError>>().map(Value::Map)
            }
            other @ (Value::Bool(_)
            | Value::Int(_)
            | Value::Uint(_)
            | Value::F32(_)
            | Value::F64(_)
            | Value::Text(_)
            | Value::Enum(..)
            | Value::Numbers(_)
            | Value::Missing) => Ok(other),
        }
    }

    fn structure(&self, ty: Arc<Struct>, mut values: Vec<Value>) -> Result<Value, RecordError> {
        let whole = Type::Named(Named::Struct(Arc::clone(&ty)));
        // Elements with a meaning of their own are converted before the rest sees them.
        let mut elements = Vec::new();
        for (at, naming) in self.views(&ty) {
            let Some(sequence) = &self.views[at].sequence else {
                continue;
            };
            let path = named(sequence, naming);
            let place = indices(&whole, &path).ok_or_else(|| {
                RecordError::Value(format!("`{}` has no member `{sequence}`", ty.name))
            })?;
            if let Some(member) = inner(&mut values, &place) {
                let converted = match std::mem::replace(member, Value::Missing) {
                    Value::Sequence(items) => {
                        let items = items.into_iter();
                        let items = items.map(|item| self.element(at, naming, item));
                        Value::Sequence(items.collect::<Result<_, _>>()?)
                    }
                    other => other,
                };
                elements.push((path, converted));
            }
        }
        let of_whole = self
            .views(&ty)
            .find(|(at, _)| self.views[*at].sequence.is_none());
        let mut out = if let Some((at, naming)) = of_whole {
            self.converted(at, naming, &ty, values)?
        } else {
            let values = values.into_iter().map(|value| self.value(value));
            Value::Struct(ty, values.collect::<Result<_, _>>()?)
        };
        if let Value::Struct(ty, values) = &mut out {
            let whole = Type::Named(Named::Struct(Arc::clone(ty)));
            for (path, converted) in elements {
                let place = indices(&whole, &path);
                if let Some(member) = place.and_then(|place| inner(values, &place)) {
                    *member = converted;
                }
            }
        }
        Ok(out)
    }

    fn element(&self, at: usize, naming: Naming, item: Value) -> Result<Value, RecordError> {
        match item {
            Value::Struct(ty, numbers) => self.converted(at, naming, &ty, numbers),
            other => Ok(other),
        }
    }

    fn converted(
        &self,
        at: usize,
        naming: Naming,
        ty: &Arc<Struct>,
        values: Vec<Value>,
    ) -> Result<Value, RecordError> {
        let change = self.change(at, naming, ty)?;
        let value = Value::Struct(Arc::clone(ty), values);
        let numbers: Vec<f64> = change
            .inputs
            .iter()
            .map(|path| number(&value, path))
            .collect();
        let results = self.views[at].program.run(&numbers).map_err(|rejected| {
            RecordError::Value(format!("a value of `{}` is refused: {rejected}", ty.name))
        })?;
        let Value::Struct(_, values) = value else {
            return Ok(value);
        };
        let slots = self.fill(&change.slots, values, &results)?;
        Ok(Value::Struct(Arc::clone(&change.ty), slots))
    }

    fn fill(
        &self,
        slots: &[Slot],
        values: Vec<Value>,
        results: &[f64],
    ) -> Result<Vec<Value>, RecordError> {
        let mut values: Vec<Option<Value>> = values.into_iter().map(Some).collect();
        let mut out = Vec::with_capacity(slots.len());
        for slot in slots {
            let mut take = |at: usize| values.get_mut(at).and_then(Option::take);
            out.push(match slot {
                Slot::Keep(at) => self.value(take(*at).unwrap_or(Value::Missing))?,
                Slot::New(tree) => tree.value(results),
                Slot::Inner(at, ty, slots) => match take(*at) {
                    Some(Value::Struct(_, inner)) => {
                        Value::Struct(Arc::clone(ty), self.fill(slots, inner, results)?)
                    }
                    _ => Value::Missing,
                },
            });
        }
        Ok(out)
    }

    /// The change of a structure, computed once for each type.
    fn change(
        &self,
        at: usize,
        naming: Naming,
        ty: &Arc<Struct>,
    ) -> Result<Arc<Change>, RecordError> {
        // Channels of one recording may have different types of one name. The kept type holds its
        // address.
        let key = (at, Arc::as_ptr(ty).addr());
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, change)) = known.get(&key) {
            return Ok(Arc::clone(change));
        }
        if known.len() >= MOST_KNOWN {
            known.clear();
        }
        let view = &self.views[at];
        let paths: Vec<Vec<String>> = view.from.iter().map(|path| named(path, naming)).collect();
        let whole = Type::Named(Named::Struct(Arc::clone(ty)));
        let mut inputs = Vec::new();
        for path in &paths {
            let place = indices(&whole, path).ok_or_else(|| {
                let path = path.join(".");
                RecordError::Value(format!("`{}` has no number `{path}`", ty.name))
            })?;
            inputs.push(place);
        }
        let to = view.to.iter().enumerate();
        let leaves = to.map(|(at, (path, number, unit))| {
            let leaf = Tree::Number(at, *number, unit.clone());
            (named(path, naming), leaf)
        });
        let fields = fields(leaves.collect());
        let dropped = view.dropped.iter().map(|path| named(path, naming));
        let sources = paths.into_iter().chain(dropped).collect();
        let (made, slots) = merged(ty, &[], &sources, fields);
        let change = Arc::new(Change {
            inputs,
            ty: Arc::new(made),
            slots,
        });
        known.insert(key, (Arc::clone(ty), Arc::clone(&change)));
        Ok(change)
    }
}

/// The plan from a prototype to the wanted one, without the names of its type.
fn view(
    library: &Library,
    network: &Network<'_>,
    own: &Prototype,
    wanted: &Prototype,
) -> Result<View, String> {
    let plan = network
        .plan(&own.name, &wanted.name)
        .map_err(|e| e.to_string())?;
    if let Some(function) = plan.program.functions().next() {
        return Err(format!("the function `{function}` would have to convert"));
    }
    let [ours, theirs] = &plan.covariances;
    let members = |of: &Prototype, covariances: &[(String, usize)]| {
        let members = library.members(of, covariances);
        members.ok_or_else(|| format!("`{}` does not say which members hold its parts", of.name))
    };
    let (from, to) = (members(own, ours)?, members(wanted, theirs)?);
    let to = to.into_iter().map(|datum| {
        let number = datum.number.unwrap_or(Primitive::F64);
        (datum.member, number, datum.unit)
    });
    // They would stay in axes and units that the rest has no more.
    let dropped = library.covariances(own).into_iter();
    let dropped = dropped.filter(|of| ours.iter().all(|(part, _)| *part != of.part));
    Ok(View {
        name: own.name.clone(),
        dropped: dropped.filter_map(|of| of.member).collect(),
        types: Vec::new(),
        from: from.into_iter().map(|datum| datum.member).collect(),
        to: to.collect(),
        told: plan
            .lost
            .iter()
            .map(ToString::to_string)
            .chain(plan.notes.iter().cloned())
            .collect(),
        program: plan.program,
        sequence: own.sequence.clone(),
    })
}

/// The numbers of the members and elements of a path. `None` if the type does not have it.
fn indices(ty: &Type, path: &[String]) -> Option<Vec<usize>> {
    let mut here = ty;
    let mut out = Vec::with_capacity(path.len());
    for word in path {
        let (at, next) = match here {
            Type::Named(Named::Struct(of)) => {
                let (at, member) = of.member(word)?;
                (at, &member.ty)
            }
            Type::Array { element, length } => {
                let at: u32 = word.parse().ok().filter(|at| at < length)?;
                (usize::try_from(at).ok()?, element.as_ref())
            }
            Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => return None,
        };
        out.push(at);
        here = next;
    }
    Some(out)
}

/// The value of a member of a structure with these values.
fn inner<'v>(values: &'v mut [Value], path: &[usize]) -> Option<&'v mut Value> {
    let (at, rest) = path.split_first()?;
    match (values.get_mut(*at)?, rest) {
        (value, []) => Some(value),
        (Value::Struct(_, values), rest) => inner(values, rest),
        _ => None,
    }
}

/// The number at a place. NaN where there is none.
fn number(value: &Value, path: &[usize]) -> f64 {
    let found = match (value, path) {
        (value, []) => return value.number().unwrap_or(f64::NAN),
        (Value::Struct(_, values) | Value::Sequence(values), [at, ..]) => values.get(*at),
        (Value::Numbers(numbers), [at]) => {
            let found = numbers.get(*at).and_then(|value| value.number());
            return found.unwrap_or(f64::NAN);
        }
        _ => None,
    };
    found.map_or(f64::NAN, |value| number(value, &path[1..]))
}

#[cfg(test)]
mod tests;
