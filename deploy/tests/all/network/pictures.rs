//! The output of `rcdeploy plan` and `rcdeploy graph`.

mod fleet;
mod goldens;
mod syntax;
mod wrong;

use rc_codegen::FileLoader;
use rc_deploy_network::{self as network, Network};
use rc_diagnostics::{Diagnostics, SourceMap};
use std::path::Path;

/// A network and its diagnostics, without those about executables.
fn load(file: &Path) -> (Network, SourceMap, Diagnostics) {
    let mut sources = SourceMap::new();
    let (network, found) = network::load(
        file,
        &network::Overrides::default(),
        &mut sources,
        &FileLoader::new(&[]),
    )
    .expect("the network is there");
    (network.expect("it can be read"), sources, found)
}
