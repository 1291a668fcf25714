use boresight_geometry::device::Wanted;
use boresight_run::config::Config;

/// The mode that the configuration asks for; it was checked when it was read.
pub(super) fn wanted(config: &Config) -> Wanted {
    config.camera.wanted().unwrap_or_default()
}

/// Says which of several cameras could be meant.
pub(super) fn several(names: &[(String, String)]) -> anyhow::Error {
    let lines: Vec<String> =
        names.iter().map(|(source, name)| format!("  {source}  {name}")).collect();
    anyhow::anyhow!("there are several cameras; say which with --source:\n{}", lines.join("\n"))
}
