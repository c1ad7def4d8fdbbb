//! Changes of the attributes that nodes get at run time.

use crate::edit::Edit;
use crate::error::Error;
use crate::snapshot::Key;
use rc_diagnostics::foreign;

impl Edit {
    /// Adds an attribute: a name, the name of a type, and a value. The model gives them no meaning.
    pub fn add_attribute(
        &mut self,
        key: impl Key,
        name: &str,
        form: &str,
        value: &str,
    ) -> Result<(), Error> {
        let place = self.next.place(key)?;
        let data = self.data(place)?;
        if data.attributes.contains_key(name) {
            return Err(Error::DuplicateAttribute {
                id: foreign::clean(&data.id),
                attribute: foreign::clean(name),
            });
        }
        let value = (form.to_owned(), value.to_owned());
        data.attributes.insert(name.to_owned(), value);
        Ok(())
    }

    /// Changes an attribute.
    pub fn set_attribute(
        &mut self,
        key: impl Key,
        name: &str,
        form: &str,
        value: &str,
    ) -> Result<(), Error> {
        let place = self.next.place(key)?;
        let data = self.data(place)?;
        let Some(known) = data.attributes.get_mut(name) else {
            return Err(Error::unknown_attribute(
                &data.id,
                name,
                data.attributes.keys(),
            ));
        };
        *known = (form.to_owned(), value.to_owned());
        Ok(())
    }

    /// Removes an attribute.
    pub fn remove_attribute(&mut self, key: impl Key, name: &str) -> Result<(), Error> {
        let place = self.next.place(key)?;
        let data = self.data(place)?;
        if data.attributes.remove(name).is_none() {
            return Err(Error::unknown_attribute(
                &data.id,
                name,
                data.attributes.keys(),
            ));
        }
        Ok(())
    }
}
