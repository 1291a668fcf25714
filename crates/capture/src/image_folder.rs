//! Pictures from files: each a separate photograph.

use std::{
    io::{BufRead, BufReader, Cursor, Read},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use image::{GrayImage, ImageFormat};

use super::{
    Arrival, CaptureError, FrameSource, SourceIdentity, Upright, decoded, integrity::JpegGate,
};
use boresight_files::{FileError, Links, open};
use boresight_geometry::{
    device::{CameraEvent, Fault},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};

/// Most bytes of a JPEG: one for each pixel at the largest size.
const PICTURE_LIMIT_BYTES: u64 = 1 << 28;

/// The pictures of a folder, in the order of their names. Unreadable pictures are reported and
/// skipped.
#[derive(Debug)]
pub struct ImageFolder {
    identity: SourceIdentity,
    files: std::vec::IntoIter<PathBuf>,
    upright: Upright,
    next: u64,
}

impl ImageFolder {
    /// Lists the pictures of `folder`, to be read with the orientation `upright`.
    ///
    /// # Errors
    ///
    /// [`CaptureError`] if the folder cannot be listed, or holds no readable picture.
    pub fn open(folder: &Path, upright: Upright) -> Result<Self, CaptureError> {
        let files = pictures_in(folder)?;
        let mut broken = None;
        let readable = files.iter().find_map(|path| match read_picture_turned(path, upright) {
            Ok(image) => Some(image),
            Err(err) => {
                broken.get_or_insert(err);
                None
            }
        });
        let none = || broken.unwrap_or(CaptureError::NoPictures { path: folder.to_path_buf() });
        let image_size = Some(ImageSize::of(&readable.ok_or_else(none)?));
        let identity = SourceIdentity { name: folder.display().to_string(), image_size };
        Ok(Self { identity, files: files.into_iter(), upright, next: 0 })
    }
}

/// Formats of pictures that are read.
const READ: [ImageFormat; 6] = [
    ImageFormat::Png,
    ImageFormat::Jpeg,
    ImageFormat::Bmp,
    ImageFormat::Pnm,
    ImageFormat::Tiff,
    ImageFormat::WebP,
];

/// True if `path` is a file with the extension of a picture that's read.
pub fn is_picture(path: &Path) -> bool {
    let format = path.extension().and_then(ImageFormat::from_extension);
    path.is_file() && format.is_some_and(|format| READ.contains(&format))
}

/// Usual extension of a picture with the first bytes `start`; `None` if it isn't read.
pub fn picture_ending(start: &[u8]) -> Option<&'static str> {
    let format = image::guess_format(start).ok().filter(|format| READ.contains(format))?;
    format.extensions_str().first().copied()
}

/// Pictures that aren't read, by extension: converters read them.
const UNREAD: [&str; 14] = [
    "heic", "heif", "avif", "jxl", "jp2", "dng", "cr2", "cr3", "nef", "arw", "raf", "orf", "rw2",
    "raw",
];

/// Name of a format that isn't read: by extension, as raw files look like TIFF, or by the brand at
/// the start of the file.
fn unread_format(path: &Path, start: &[u8]) -> Option<String> {
    let ending = path.extension().and_then(|ending| ending.to_str());
    let ending = ending.map(str::to_ascii_lowercase);
    let brand = match start.get(4..12) {
        Some(b"ftypheic" | b"ftypheix" | b"ftypmif1" | b"ftypmsf1") => Some("heic"),
        Some(b"ftypavif") => Some("avif"),
        _ => None,
    };
    let by_ending = ending.as_deref().filter(|ending| UNREAD.contains(ending));
    Some(brand.or(by_ending)?.to_ascii_uppercase())
}

/// Picture files of `folder` by extension, sorted by name.
///
/// # Errors
///
/// [`CaptureError`] if the folder can't be listed, or holds none.
pub fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, CaptureError> {
    let failed = |source| CaptureError::Read { source, path: folder.to_path_buf() };
    let mut files = Vec::new();
    for entry in folder.read_dir().map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if is_picture(&path) {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(CaptureError::NoPictures { path: folder.to_path_buf() });
    }
    files.sort();
    Ok(files)
}

/// Names of the pictures in `folder` outside of [`pictures_in`], of other kinds by extension,
/// sorted. Empty if the folder can't be listed.
pub fn unread_pictures_in(folder: &Path) -> Vec<String> {
    let is_unread = |path: &Path| path.is_file() && unread_format(path, &[]).is_some();
    let files = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
    let names = files
        .filter(|path| is_unread(path))
        .filter_map(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()));
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

impl FrameSource for ImageFolder {
    fn identity(&self) -> SourceIdentity {
        self.identity.clone()
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        let Some(path) = self.files.next() else { return Ok(Arrival::End) };
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let image = match read_picture_turned(&path, self.upright) {
            Ok(image) => image,
            Err(CaptureError::Decode { reason, .. }) => {
                let (fault, detail) = (Fault::BrokenPicture, format!("{name}: {reason}"));
                return Ok(Arrival::Event(CameraEvent::Doubtful { fault, detail }));
            }
            Err(err) => return Err(err),
        };
        let id = FrameId(self.next);
        self.next += 1;
        // Photographs are a second apart: there's no motion between them.
        let captured_at = CaptureTime { nanos: id.0 * 1_000_000_000 };
        let kind = FrameKind::Photograph;
        Ok(Arrival::Frame(Arc::new(Frame { id, captured_at, kind, name, image })))
    }
}

/// Reads a picture as brightness, turned by the EXIF orientation.
///
/// # Errors
///
/// As [`read_picture_turned`].
pub fn read_picture(path: &Path) -> Result<GrayImage, CaptureError> {
    read_picture_turned(path, Upright::AsMarked)
}

/// Reads a picture as brightness, like [`decoded`]: PNG, JPEG, BMP, PGM and PPM, TIFF or WebP.
///
/// # Errors
///
/// [`CaptureError::Read`], or [`CaptureError::Decode`] if the file is no picture, is cut, or is too
/// large.
pub fn read_picture_turned(path: &Path, upright: Upright) -> Result<GrayImage, CaptureError> {
    let read = |source| CaptureError::Read { source, path: path.to_path_buf() };
    let decode = |reason: String| CaptureError::Decode { reason, path: path.to_path_buf() };
    let file = open(path, Links::Followed).map_err(|err| match err {
        FileError::Read { source, path } => CaptureError::Read { source, path },
        FileError::NotAFile { what, .. } => decode(format!("this is {what}, not a file")),
        other => decode(other.to_string()),
    })?;
    let mut file = BufReader::new(file);
    let start = file.fill_buf().map_err(read)?;
    if let Some(name) = unread_format(path, start) {
        return Err(decode(format!("{name} isn't read. Convert it to PNG or JPEG first")));
    }
    let format = image::guess_format(start).ok().filter(|format| READ.contains(format));
    let Some(format) = format else {
        let read = "PNG, JPEG, BMP, PGM, PPM, TIFF or WebP";
        return Err(decode(format!("its contents are none of {read}")));
    };
    let image = if format == ImageFormat::Jpeg {
        let mut bytes = Vec::new();
        file.by_ref().take(PICTURE_LIMIT_BYTES).read_to_end(&mut bytes).map_err(read)?;
        if !is_whole_jpeg(&bytes) {
            return Err(decode("it is cut short".into()));
        }
        decoded(Cursor::new(JpegGate::with_tables(bytes)), format, upright)
    } else {
        decoded(file, format, upright)
    };
    image.map_err(decode)
}

/// True if a JPEG is complete up to the end-of-image marker; decoders fill missing parts with grey.
///
/// Segments are skipped by their lengths: the thumbnail in one of them has its own end. Some
/// cameras append data after the marker.
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xDA;
    const END_OF_IMAGE: u8 = 0xD9;
    let mut at = 2;
    let mut in_scan = false;
    while let Some(&byte) = bytes.get(at) {
        let Some(&marker) = bytes.get(at + 1) else { return false };
        match (byte, marker) {
            (0xFF, END_OF_IMAGE) => return true,
            // A stuffed byte, a fill byte, a restart: the scan continues.
            (0xFF, 0x00 | 0xFF | 0xD0..=0xD7) => at += if marker == 0xFF { 1 } else { 2 },
            (0xFF, _) => {
                let Some(&[high, low]) = bytes.get(at + 2..at + 4) else { return false };
                at += 2 + usize::from(u16::from_be_bytes([high, low]));
                in_scan = marker == START_OF_SCAN;
            }
            _ if in_scan => at += 1,
            _ => return false,
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use image::{
        DynamicImage, ImageBuffer, ImageEncoder, Luma, LumaA, Rgb, Rgba, codecs::jpeg::JpegEncoder,
    };

    use super::*;

    #[test]
    fn deep_and_coloured_files_are_read_as_brightness() {
        let place = tempfile::tempdir().expect("a folder");
        let read = |name: &str, picture: DynamicImage| {
            let path = place.path().join(name);
            picture.save(&path).expect("written");
            read_picture(&path).expect("read")
        };
        let ramp = |x: u32| (x * 257) as u16;
        let deep = ImageBuffer::from_fn(300, 1, |x, _| Luma([(x * 218) as u16]));
        for (deep, grey) in deep.pixels().zip(read("deep.png", deep.clone().into()).pixels()) {
            let wanted = (255.0 * f64::from(deep.0[0]) / 65535.0).round();
            assert_eq!(f64::from(grey.0[0]), wanted, "{deep:?}");
        }
        let grey = GrayImage::from_fn(256, 1, |x, _| Luma([x as u8]));
        let seen = ImageBuffer::from_fn(256, 1, |x, _| LumaA([x as u8, 255 - x as u8]));
        assert_eq!(read("seen.png", seen.into()), grey);
        let seen = ImageBuffer::from_fn(256, 1, |x, _| Rgba([ramp(x), ramp(x), ramp(x), 9]));
        assert_eq!(read("deep_colours.png", seen.into()), grey);
        let colours = ImageBuffer::from_fn(3, 1, |x, _| {
            Rgb([0, 1, 2].map(|at| if at == x { 255_u8 } else { 0 }))
        });
        assert_eq!(read("colours.png", colours.into()).into_raw(), [54, 182, 18]);
        let even = ImageBuffer::from_pixel(64, 64, Rgb([200_u8, 100, 40]));
        for pixel in read("colours.jpeg", even.into()).pixels() {
            assert!(pixel.0[0].abs_diff(117) <= 2, "{pixel:?}");
        }
    }

    /// Formats of the tools that come with industrial cameras.
    #[test]
    fn pictures_of_camera_tools_are_read_alike() {
        let place = tempfile::tempdir().expect("a folder");
        let grey = GrayImage::from_fn(40, 30, |x, y| Luma([(x * 5 + y) as u8]));
        let deep =
            ImageBuffer::from_fn(40, 30, |x, y| Luma([u16::from(grey.get_pixel(x, y).0[0]) * 257]));
        for ending in ["bmp", "pgm", "ppm", "tif", "tiff", "webp", "png"] {
            let path = place.path().join(format!("a.{ending}"));
            let seen = DynamicImage::from(grey.clone());
            let seen =
                if ["ppm", "webp"].contains(&ending) { seen.into_rgb8().into() } else { seen };
            seen.save(&path).expect("written");
            assert!(is_picture(&path), "{ending}");
            assert_eq!(read_picture(&path).expect("read"), grey, "{ending}");
            let bytes = std::fs::read(&path).expect("there");
            assert_ne!(picture_ending(&bytes[..12]), None, "{ending}");
            std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("written");
            read_picture(&path).expect_err("cut");
        }
        for ending in ["pgm", "tif"] {
            let path = place.path().join(format!("deep.{ending}"));
            DynamicImage::from(deep.clone()).save(&path).expect("written");
            assert_eq!(read_picture(&path).expect("read"), grey, "{ending}");
        }
    }

    #[test]
    fn a_picture_that_is_not_read_is_named_with_the_way_out() {
        let place = tempfile::tempdir().expect("a folder");
        let tiff = b"II*\0\x08\0\0\0\0\0\0\0";
        let heic = b"\0\0\0\x18ftypheic\0\0\0\0";
        for (name, start, format) in
            [("a.DNG", &tiff[..], "DNG"), ("a.heic", heic, "HEIC"), ("a.jpg", heic, "HEIC")]
        {
            let path = place.path().join(name);
            std::fs::write(&path, start).expect("written");
            let said = read_picture(&path).expect_err("not read").to_string();
            assert!(said.contains(&format!("{format} isn't read. Convert it to PNG")), "{said}");
        }
    }

    /// Cameras of 10 and 12 bits write their values unscaled.
    #[test]
    fn values_of_ten_and_twelve_bits_fill_the_range() {
        let place = tempfile::tempdir().expect("a folder");
        let [png, pgm] = ["a.png", "a.pgm"].map(|name| place.path().join(name));
        for full in [1023_u32, 4095, 65535] {
            let at = |x: u32| (x * full / 299) as u16;
            let deep = ImageBuffer::from_fn(300, 1, |x, _| Luma([at(x)]));
            DynamicImage::from(deep).save(&png).expect("written");
            let values = (0..300).flat_map(|x| at(x).to_be_bytes());
            let bytes = format!("P5\n300 1\n{full}\n").into_bytes().into_iter().chain(values);
            std::fs::write(&pgm, bytes.collect::<Vec<u8>>()).expect("written");
            for path in [&png, &pgm] {
                for (x, pixel) in read_picture(path).expect("read").pixels().enumerate() {
                    let wanted = (255.0 * f64::from(at(x as u32)) / f64::from(full)).round();
                    assert_eq!(f64::from(pixel.0[0]), wanted, "{x} of {full} in {path:?}");
                }
            }
        }
    }

    #[test]
    fn photographs_are_turned_as_their_mark_says() {
        let place = tempfile::tempdir().expect("a folder");
        // The stored picture has a light corner at the start of the first row and column.
        let stored =
            GrayImage::from_fn(48, 32, |x, y| Luma([if x < 16 && y < 16 { 220 } else { 40 }]));
        // The side of the shown picture with the first stored row, and with the first column (EXIF
        // 2.3, 4.6.4).
        let sides = ["top left", "top right", "bottom right", "bottom left"];
        let turned = ["left top", "right top", "right bottom", "left bottom"];
        for (mark, side) in (1_u8..).zip(sides.into_iter().chain(turned)) {
            let orientation = [0x12, 1, 3, 0, 1, 0, 0, 0, mark, 0, 0, 0];
            let exif = [&b"II*\0\x08\0\0\0\x01\0"[..], &orientation, &[0; 4]].concat();
            let mut bytes = Vec::new();
            let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 95);
            encoder.set_exif_metadata(exif).expect("JPEG has room for it");
            encoder.encode_image(&stored).expect("encoded");
            let path = place.path().join(format!("{mark}.jpg"));
            std::fs::write(&path, bytes).expect("written");

            let shown = read_picture(&path).expect("read");
            let is_turned = mark >= 5;
            assert_eq!(shown.dimensions(), if is_turned { (32, 48) } else { (48, 32) }, "{side}");
            let x = if side.contains("left") { 4 } else { shown.width() - 5 };
            let y = if side.contains("top") { 4 } else { shown.height() - 5 };
            assert!(shown.get_pixel(x, y).0[0] > 200, "{side}");
            let (w, h) = (shown.width() - 1, shown.height() - 1);
            assert!(shown.get_pixel(w - x, h - y).0[0] < 60, "{side}");
            assert!(shown.get_pixel(w - x, y).0[0] < 60, "{side}");

            let as_stored = read_picture_turned(&path, Upright::AsStored).expect("read");
            assert_eq!(as_stored.dimensions(), (48, 32));
            assert!(as_stored.get_pixel(4, 4).0[0] > 200, "{side}");
        }
    }
}
