//! Writes pictures of the simulated street: `street_pictures FOLDER STREET EVERY_MINUTES`.

use boresight_station::street::Street;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, street, every] = arguments.as_slice() else {
        return Err("FOLDER STREET EVERY_MINUTES".into());
    };
    let street = Street::parse(street)?;
    let every_secs = 60.0 * every.parse::<f64>()?;
    for n in 0..(street.days * 86_400.0 / every_secs) as u64 {
        let at = street.began_secs + n as f64 * every_secs;
        street.picture(at).save(format!("{folder}/{at}.png"))?;
    }
    Ok(())
}
