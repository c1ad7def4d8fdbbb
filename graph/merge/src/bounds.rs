//! Limits that every replica keeps, and limits of a delta: a delta beyond them is refused as a
//! whole.

use crate::error::Error;
use crate::limits::{MOST_ATTRIBUTES, MOST_NAME, MOST_VALUE, MOST_WRITERS, is_far};
use crate::record::{Delta, Record, Stamp, count};
use crate::replica::Replica;
use property_graph::{Id, MOST_BYTES, Value};
use std::collections::{BTreeMap, HashSet};

/// Refuses a name that no schema has: an empty or long one, or one with control characters.
pub(crate) fn check_name(name: &str, writer: u64) -> Result<(), Error> {
    let is_sound = (1..=MOST_NAME).contains(&name.len()) && !name.chars().any(char::is_control);
    is_sound.then_some(()).ok_or(Error::Name(writer))
}

/// Refuses a value that no graph holds, or that no message carries: a text of CDR ends with its first
/// zero byte.
pub(crate) fn check_value(value: &Value, writer: u64) -> Result<(), Error> {
    let most = match value {
        Value::Bytes(_) => MOST_BYTES,
        _ => MOST_VALUE,
    };
    let has_zero = match value {
        Value::Text(text) => text.contains('\0'),
        Value::Texts(all) => all.iter().any(|text| text.contains('\0')),
        Value::Sample(sample) => sample.topic.contains('\0') || sample.kind.contains('\0'),
        _ => false,
    };
    let is_sound = value.is_finite() && value.size() <= most && !has_zero;
    is_sound.then_some(()).ok_or(Error::Value(writer))
}

impl Replica {
    /// Refuses an element of this replica that no other one would take.
    pub(crate) fn check_new(&self, kind: &str) -> Result<(), Error> {
        check_name(kind, self.writer())?;
        if self.kept() >= self.most_elements {
            return Err(Error::TooManyElements(self.most_elements));
        }
        Ok(())
    }

    /// Refuses a value of this replica that no other one would take.
    pub(crate) fn check_set(&self, of: Id, name: &str, value: Option<&Value>) -> Result<(), Error> {
        let is_new = self.check_value(of, name, value)?;
        if is_new && self.attribute_count(of) >= MOST_ATTRIBUTES {
            return Err(Error::TooManyAttributes(MOST_ATTRIBUTES));
        }
        Ok(())
    }

    /// Whether the replica accepts a change as a whole: new elements of these types, and these
    /// attributes. It makes nothing that other replicas would refuse.
    ///
    /// # Errors
    /// No type or attribute has one of the names, no graph holds one of the values, or the replica
    /// would keep too many elements, or too many attributes of one of them.
    pub fn check_change<'a>(
        &self,
        kinds: impl IntoIterator<Item = &'a str>,
        set: impl IntoIterator<Item = (Id, &'a str, Option<&'a Value>)>,
    ) -> Result<(), Error> {
        let mut elements = self.kept();
        for kind in kinds {
            check_name(kind, self.writer())?;
            elements += 1;
            if elements > self.most_elements {
                return Err(Error::TooManyElements(self.most_elements));
            }
        }
        let mut new: BTreeMap<Id, HashSet<&str>> = BTreeMap::new();
        for (of, name, value) in set {
            if self.check_value(of, name, value)? {
                let names = new.entry(of).or_default();
                names.insert(name);
                if names.len() + self.attribute_count(of) > MOST_ATTRIBUTES {
                    return Err(Error::TooManyAttributes(MOST_ATTRIBUTES));
                }
            }
        }
        Ok(())
    }

    /// Whether an attribute would be new.
    fn check_value(&self, of: Id, name: &str, value: Option<&Value>) -> Result<bool, Error> {
        check_name(name, self.writer())?;
        if let Some(value) = value {
            check_value(value, self.writer())?;
        }
        let element = self.elements.get(&of);
        Ok(element.is_none_or(|element| !element.attributes.has(name)))
    }

    fn attribute_count(&self, of: Id) -> usize {
        let element = self.elements.get(&of);
        element.map_or(0, |element| element.attributes.len())
    }

    /// Refuses what no replica sends, as [`Replica::merge`] does, and changes nothing.
    ///
    /// # Errors
    /// Those of [`Replica::merge`].
    pub fn check(&self, delta: &Delta) -> Result<(), Error> {
        self.check_numbers(delta, is_far)
    }

    /// Checks as [`check`](Self::check). `is_far` says whether a number is too far ahead of the known
    /// one.
    pub(crate) fn check_numbers(
        &self,
        delta: &Delta,
        is_far: impl Fn(u64, u64) -> bool,
    ) -> Result<(), Error> {
        let own = count(self.seen(), self.writer());
        let is_complete = delta.all_of.is_none_or(|(_, ranges)| ranges <= 1)
            && count(&delta.since, self.writer()) <= own;
        let most_own = if is_complete && !self.has_changed {
            own.max(count(&delta.upto, self.writer()))
        } else {
            own
        };
        let sequence = |writer: u64, sequence: u64| {
            if is_far(sequence, count(self.seen(), writer)) {
                return Err(Error::TooFar(writer));
            }
            if writer == self.writer() && sequence > most_own {
                return Err(Error::SameWriter(writer));
            }
            Ok(())
        };
        let vectors = [&delta.upto, &delta.seen, &delta.forgotten];
        for (writer, number) in vectors.into_iter().flatten() {
            sequence(*writer, *number)?;
        }
        for record in &delta.records {
            let (stamp, id) = (record.stamp(), record.of());
            if stamp.sequence == 0 || stamp.count == 0 {
                return Err(Error::NoNumber(stamp.writer));
            }
            if is_far(stamp.count, self.count()) {
                return Err(Error::TooFar(stamp.writer));
            }
            sequence(stamp.writer, stamp.sequence)?;
            sequence(id.writer(), id.count())?;
            if let Record::Edge { from, to, .. } = record {
                for end in [from, to] {
                    sequence(end.writer(), end.count())?;
                }
            }
            self.check_record(record, stamp)?;
        }
        self.check_counts(delta)
    }

    fn check_record(&self, record: &Record, stamp: Stamp) -> Result<(), Error> {
        match record {
            Record::Node { kind, .. } | Record::Edge { kind, .. } => {
                check_name(kind, stamp.writer)?;
            }
            Record::Attribute { name, value, .. } => {
                check_name(name, stamp.writer)?;
                if let Some(value) = value {
                    check_value(value, stamp.writer)?;
                }
            }
            Record::Removed { .. } => {}
        }
        // The replica itself is the authority on its own changes.
        if stamp.writer == self.writer() && self.contradicts(record) {
            return Err(Error::SameWriter(stamp.writer));
        }
        Ok(())
    }

    /// Refuses more than a replica keeps.
    fn check_counts(&self, delta: &Delta) -> Result<(), Error> {
        let count = delta.records.len();
        let most_attributes = |of: Id| self.attribute_count(of) + count <= MOST_ATTRIBUTES;
        let are_few = self.kept() + count <= self.most_elements
            && self.seen().len() + delta.upto.len() + count <= MOST_WRITERS
            && delta
                .records
                .iter()
                .all(|record| most_attributes(record.of()));
        // The usual case: as many could be new, and none is too many.
        if !are_few {
            self.check_new_ones(delta)?;
        }
        let is_new = delta.sender != self.writer() && !self.others.contains_key(&delta.sender);
        if is_new && self.others.len() >= MOST_WRITERS {
            return Err(Error::TooManyWriters(MOST_WRITERS));
        }
        Ok(())
    }

    /// Refuses more writers, elements and attributes than a replica keeps.
    fn check_new_ones(&self, delta: &Delta) -> Result<(), Error> {
        let mut writers: HashSet<u64> = delta.upto.keys().copied().collect();
        let mut new: HashSet<Id> = HashSet::new();
        let mut names: BTreeMap<Id, HashSet<&str>> = BTreeMap::new();
        for record in &delta.records {
            let id = record.of();
            writers.insert(record.stamp().writer);
            let element = self.elements.get(&id);
            if element.is_none() {
                new.insert(id);
            }
            if let Record::Attribute { name, .. } = record {
                let known = element.is_some_and(|e| e.attributes.has(name));
                if !known {
                    let names = names.entry(id).or_default();
                    names.insert(name);
                    if names.len() + self.attribute_count(id) > MOST_ATTRIBUTES {
                        return Err(Error::TooManyAttributes(MOST_ATTRIBUTES));
                    }
                }
            }
        }
        if !new.is_empty() && self.kept() + new.len() > self.most_elements {
            return Err(Error::TooManyElements(self.most_elements));
        }
        writers.retain(|writer| !self.seen().contains_key(writer));
        if !writers.is_empty() && self.seen().len() + writers.len() > MOST_WRITERS {
            return Err(Error::TooManyWriters(MOST_WRITERS));
        }
        Ok(())
    }
}
