//! Runs a whole session with the simulated camera through the library: no window, no command line.
//!
//! cargo run --release --no-default-features --example headless_session

use std::sync::Arc;

use boresight::{
    app::{Announcer, Host, Opening},
    config::Config,
};

fn main() -> anyhow::Result<()> {
    let announcer = Announcer::new(|line| println!("{line}"));
    let settings = ["guidance.plan=\"quick\"".to_owned()];
    let opening = Opening::new("sim", Config::load(None, &settings)?);
    // The simulated technician reads the guidance and moves the board until the plan is complete.
    let concluded = Host::new(announcer, Arc::default()).session(&opening)?;
    println!("exit status: {:?}", concluded.exit);
    Ok(())
}
