//! A USB camera in user space, to test the kernel's own USB and camera drivers with faults on
//! demand: `uvcsim [--name NAME] [--serial SERIAL] [--pictures FOLDER [--before N]] [--twin]`,
//! commands on standard input.
//!
//! It needs the module vhci-hcd, and root; the test machine (`tests/vm/vm.sh`) has both. Commands,
//! one a line:
//!
//! ```text
//! unplug          plug            name TEXT       serial TEXT     (the names hold from the next plug on)
//! freeze          thaw            slow MILLIS     drop N          short N       badjpeg N      errbit N
//! nodht 0|1       stall_stream    stall_commit 0|1                set CONTROL VALUE
//! ctldelay MILLIS (of every control transfer)     torn N          only WIDTHxHEIGHT | only (from the next plug on, too)
//! times none|steady|jump (of the camera's own clock; the driver heeds it with hwtimestamps=1)
//! ```

mod controls;
mod device;
mod modes;
mod pictures;
mod stream;

use std::{io::BufRead, path::PathBuf, process::ExitCode, sync::Arc, time::Duration};

use device::{Device, Faults, Times};
use pictures::Pictures;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(err) => {
            eprintln!("uvcsim: {err}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1).cloned()
    };
    let mut name = value("--name").unwrap_or_else(|| "uvcsim HD camera".into());
    let mut serial = value("--serial").unwrap_or_else(|| "0001".into());
    let pictures = Arc::new(Pictures::of(
        value("--pictures").map(PathBuf::from).as_deref(),
        value("--before").and_then(|count| count.parse().ok()).unwrap_or(0),
    )?);
    let plug =
        |name: &str, serial: &str, port| Device::plug(name, serial, Arc::clone(&pictures), port);
    let mut device = Some(plug(&name, &serial, 0)?);
    let _twin =
        arguments.iter().any(|a| a == "--twin").then(|| plug(&name, &serial, 1)).transpose()?;
    println!("uvcsim: plugged in");
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        eprintln!("uvcsim: {line}");
        let (command, rest) = line.split_once(' ').unwrap_or((&line, ""));
        match command {
            "unplug" => {
                if let Some(device) = device.take() {
                    device.unplug();
                }
            }
            "plug" if device.is_none() => device = Some(plug(&name, &serial, 0)?),
            "name" => name = rest.into(),
            "serial" => serial = rest.into(),
            "times" => *device::locked(&device::TIMES) = Times::called(rest),
            "only" => *device::locked(&device::ONLY) = size(rest),
            _ => {
                if let Some(device) = &device {
                    obey(device, command, rest);
                }
            }
        }
    }
    // Without a writer the camera stays as it is.
    loop {
        std::thread::sleep(Duration::from_secs(3600));
    }
}

/// A size such as `320x240`.
fn size(text: &str) -> Option<(u16, u16)> {
    let (width, height) = text.split_once('x')?;
    Some((width.parse().ok()?, height.parse().ok()?))
}

fn obey(device: &Device, command: &str, rest: &str) {
    if command == "set" {
        let (name, value) = rest.split_once(' ').unwrap_or((rest, ""));
        let mut controls =
            device.shared.controls.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let control = controls.iter_mut().find(|control| control.name == name);
        match (control, value.parse()) {
            (Some(control), Ok(value)) => control.value = value,
            _ => eprintln!("uvcsim: cannot set {rest}"),
        }
        return;
    }
    let number = rest.parse().unwrap_or(1);
    let mut faults = device.shared.faults.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let Faults {
        freeze,
        error_bits,
        short,
        bad_jpeg,
        dropped,
        no_tables,
        stall_commit,
        stall_stream,
        slow_millis,
        torn,
        control_millis,
    } = &mut *faults;
    match command {
        "freeze" => *freeze = true,
        "thaw" => *freeze = false,
        "errbit" => *error_bits = number,
        "short" => *short = number,
        "badjpeg" => *bad_jpeg = number,
        "drop" => *dropped = number,
        "nodht" => *no_tables = number != 0,
        "stall_commit" => *stall_commit = number != 0,
        "stall_stream" => *stall_stream = true,
        "slow" => *slow_millis = number.into(),
        "torn" => *torn = number,
        "ctldelay" => *control_millis = number.into(),
        _ => eprintln!("uvcsim: unknown command"),
    }
}
