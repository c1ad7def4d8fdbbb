//! The files of meshes and textures.

use super::Reader;
use crate::include::{self, Found};
use crate::model::{Display, Kind, Mesh, Plane};
use rc_diagnostics::{Diagnostic, Name, Span};
use std::path::Path;

impl Reader<'_> {
    /// Finds the file of a mesh or of a texture, which the attribute `named` names.
    pub(super) fn find_file(
        &mut self,
        kind: &mut Kind,
        named: Option<Name>,
        tag: Span,
        folder: &Path,
    ) {
        match kind {
            Kind::Mesh(mesh) => self.mesh(mesh, named, tag, folder),
            Kind::Plane(plane) | Kind::Display(Display { plane, .. }) => {
                self.texture(plane, named, folder);
            }
            _ => {}
        }
    }

    pub(super) fn moved(&mut self, found: &Found, written: &Name) {
        if let Found::Elsewhere(path) = found {
            let message = format!("`{}` was found as `{}`", written.text, path.display());
            self.found
                .push(Diagnostic::note("file-elsewhere", written.span, message));
        }
    }

    /// Finds the file of a mesh.
    fn mesh(&mut self, mesh: &mut Mesh, written: Option<Name>, tag: Span, folder: &Path) {
        let Some(written) = written else {
            let message = "the attribute `file` is missing";
            self.found
                .push(Diagnostic::warning("missing-mesh", tag, message));
            return;
        };
        let Some(found) = include::find(self.loader, folder, &written.text) else {
            let message = format!("cannot find the mesh `{}`", written.text);
            let finding = Diagnostic::warning("missing-mesh", written.span, message);
            self.found.push(finding.help(
                "it is looked for next to this file, then by its base name \
                along the search path: `-I FOLDER`",
            ));
            return;
        };
        self.moved(&found, &written);
        let elsewhere = matches!(found, Found::Elsewhere(_));
        let path = found.path();
        if folder != self.home || !elsewhere {
            mesh.file = include::written(&path, &self.home);
        }
        mesh.path = Some(path);
    }

    /// Finds the file of a texture. `#rrggbb` is a colour, and `custom` a picture that RoboComp's
    /// programs set while they run.
    fn texture(&mut self, plane: &mut Plane, written: Option<Name>, folder: &Path) {
        let Some(written) = written else {
            return;
        };
        if written.text.is_empty() || written.text.starts_with('#') || written.text == "custom" {
            return;
        }
        let Some(found) = include::find(self.loader, folder, &written.text) else {
            let message = format!("cannot find the texture `{}`", written.text);
            let finding = Diagnostic::warning("missing-texture", written.span, message);
            self.found.push(finding.help(
                "it is looked for next to this file, then by its base name along the search path: \
                `-I FOLDER`; a colour is written as `#rrggbb`",
            ));
            return;
        };
        self.moved(&found, &written);
        let elsewhere = matches!(found, Found::Elsewhere(_));
        let path = found.path();
        if folder != self.home || !elsewhere {
            plane.texture = include::written(&path, &self.home);
        }
        plane.picture = Some(path);
    }
}
