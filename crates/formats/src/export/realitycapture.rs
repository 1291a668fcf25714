use super::{Coefficients, ExportedCamera, NotExpressible, number::number};

/// The calibration as RealityCapture's XMP sidecar, without a pose: `perspective`, `brown3`, or
/// `brown3t2` with tangential distortion.
///
/// Focal length and principal point are in units of the longer side, the focal length of a film 36
/// wide; the principal point counts from the middle, with pixels from the corner of the top-left
/// one. `t1` and `t2` are OpenCV's `p2` and `p1`. RealityCapture knows the size from the picture;
/// for other readers, it's in XMP's own fields for it.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let [k1, k2, p1, p2, k3] = match exported.coefficients() {
        Coefficients::None => [0.0; 5],
        Coefficients::Brown(coefficients) => coefficients,
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye(_) => return Err(NotExpressible::Lens { lens: "fisheye" }),
    };
    let [fx, fy, cx, cy] = exported.intrinsics();
    if fx.to_bits() != fy.to_bits() {
        return Err(NotExpressible::Lens { lens: "anamorphic" });
    }
    let model = match exported.coefficients() {
        Coefficients::None => "perspective",
        _ if p1 == 0.0 && p2 == 0.0 => "brown3",
        _ => "brown3t2",
    };
    let size = exported.image_size;
    let [width, height] = [size.width_px, size.height_px].map(f64::from);
    let longer = width.max(height);
    let film = fx * 36.0 / longer;
    if !film.is_finite() {
        return Err(NotExpressible::Lens { lens: "so long" });
    }
    let coefficients = [k1, k2, k3, 0.0, p2, p1].map(number).join(" ");
    let attributes = [
        ("Version", "3".to_owned()),
        ("DistortionModel", model.into()),
        ("FocalLength35mm", number(film)),
        ("Skew", "0".into()),
        ("AspectRatio", "1".into()),
        ("PrincipalPointU", number((cx + 0.5 - width / 2.0) / longer)),
        ("PrincipalPointV", number((cy + 0.5 - height / 2.0) / longer)),
        ("CalibrationPrior", "exact".into()),
        ("CalibrationGroup", "-1".into()),
        ("DistortionGroup", "-1".into()),
    ];
    let attributes = attributes.map(|(name, value)| format!("\n      xcr:{name}=\"{value}\""));
    Ok(format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n  <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n    \
         <rdf:Description xmlns:xcr=\"http://www.capturingreality.com/ns/xcr/1.1#\"\n      \
         xmlns:tiff=\"http://ns.adobe.com/tiff/1.0/\"\n      tiff:ImageWidth=\"{}\"\n      tiff:ImageLength=\"{}\"{}>\n      \
         <xcr:DistortionCoeficients>{coefficients}</xcr:DistortionCoeficients>\n    </rdf:Description>\n  </rdf:RDF>\n</x:xmpmeta>\n",
        size.width_px,
        size.height_px,
        attributes.concat(),
    ))
}
