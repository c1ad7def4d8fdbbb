//! Messages that no replica of this schema sends.

use crate::core::{Core, MOST_ELEMENTS};
use graph_merge::{Record, Replica, allows, has_attribute, missing};
use graph_schema::Schema;
use property_graph::Id;
use rc_diagnostics::foreign;
use std::collections::{BTreeSet, HashMap};

/// How long a name is at most, in bytes.
const MOST_NAME: usize = 256;

/// The limits of a replica.
pub(crate) struct Check<'c> {
    schema: &'c Schema,
    replica: &'c Replica,
}

impl<'c> Check<'c> {
    pub(crate) fn of(core: &'c Core) -> Self {
        Self {
            schema: &core.schema,
            replica: &core.replica,
        }
    }

    /// Refuses changes that break the schema by themselves. Two that are sound by themselves may break
    /// it together, which is not a fault of anybody.
    pub(crate) fn records(&self, records: &[Record]) -> Result<(), String> {
        let is_set = |record: &Record| matches!(record, Record::Attribute { value: Some(_), .. });
        if records.iter().all(is_set) {
            // The usual case: nothing is made that lacks something, and nothing loses something.
            return self.values(records, |_| None);
        }
        let mut kinds: HashMap<Id, &str> = HashMap::new();
        let (mut set, mut unset) = (BTreeSet::new(), BTreeSet::new());
        let mut removed: BTreeSet<Id> = BTreeSet::new();
        for record in records {
            match record {
                Record::Node { kind, .. } | Record::Edge { kind, .. } => {
                    self.kind(record, kind)?;
                    kinds.insert(record.of(), kind);
                }
                Record::Attribute {
                    of, name, value, ..
                } => {
                    let all = if value.is_some() {
                        &mut set
                    } else {
                        &mut unset
                    };
                    all.insert((*of, &**name));
                }
                Record::Removed { of, .. } => {
                    removed.insert(*of);
                }
            }
        }
        self.room(records)?;
        self.values(records, |of| kinds.get(&of).copied())?;
        let is_there = |id: Id, name: &str| {
            let is_here = || !unset.contains(&(id, name)) && self.replica.get(id, name).is_some();
            set.contains(&(id, name)) || is_here()
        };
        let changed = unset.iter().filter_map(|(id, _)| {
            let kind = self.replica.kind_of(*id)?;
            Some((*id, kind))
        });
        let all = kinds.iter().map(|(id, kind)| (*id, *kind)).chain(changed);
        for (id, kind) in all {
            if removed.contains(&id) || self.replica.is_removed(id) {
                continue;
            }
            if let Some(name) = missing(self.schema, kind, |name| is_there(id, name)) {
                return Err(format!("a `{kind}` has no `{name}`"));
            }
        }
        Ok(())
    }

    /// Refuses values of changes. `made` has the types of the elements that are made in it.
    fn values<'d>(
        &'d self,
        records: &[Record],
        made: impl Fn(Id) -> Option<&'d str>,
    ) -> Result<(), String> {
        for record in records {
            if let Record::Attribute {
                of, name, value, ..
            } = record
            {
                let kind = made(*of).or_else(|| self.replica.kind_of(*of));
                self.value(kind, name, value.as_ref())?;
            }
        }
        Ok(())
    }

    /// Refuses more elements than a world has.
    pub(crate) fn room(&self, records: &[Record]) -> Result<(), String> {
        let is_new = |record: &&Record| matches!(record, Record::Node { .. } | Record::Edge { .. });
        let new = records.iter().filter(is_new).count();
        if self.replica.kept().saturating_add(new) > 2 * MOST_ELEMENTS {
            return Err(format!("a world has at most {MOST_ELEMENTS} elements"));
        }
        Ok(())
    }

    fn kind(&self, record: &Record, kind: &str) -> Result<(), String> {
        let is_known = match record {
            Record::Node { .. } => self.schema.entity(kind).is_some(),
            _ => self.schema.relation(kind).is_some(),
        };
        let is_name = kind.len() <= MOST_NAME && !kind.chars().any(char::is_control);
        if is_known || self.schema.open && is_name {
            return Ok(());
        }
        Err(format!("the schema has no type `{}`", short(kind)))
    }

    /// Refuses a value. If the type is not known, the attribute may be that of any one.
    pub(crate) fn value(
        &self,
        kind: Option<&str>,
        name: &str,
        value: Option<&property_graph::Value>,
    ) -> Result<(), String> {
        let is_name = name.len() <= MOST_NAME && !name.chars().any(char::is_control);
        let is_sound = is_name
            && match (kind, value) {
                (Some(kind), Some(value)) => allows(self.schema, kind, name, value),
                (Some(kind), None) => has_attribute(self.schema, kind, name),
                (None, value) => value.is_none_or(property_graph::Value::is_finite),
            };
        if is_sound {
            return Ok(());
        }
        let kind = kind.map_or_else(
            || "an element".to_owned(),
            |kind| format!("`{}`", short(kind)),
        );
        Err(format!(
            "the schema does not allow this value of `{}` of {kind}",
            short(name)
        ))
    }
}

fn short(text: &str) -> String {
    let text: String = text.chars().take(64).collect();
    foreign::clean(&text)
}
