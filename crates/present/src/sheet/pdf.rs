use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str, TextStr};

use super::{Sheet, Words};

/// Points, the unit of PDF, per millimetre: 1/72 inch each.
const POINTS_PER_MM: f64 = 72.0 / 25.4;
/// Tangent length of a Bézier quarter circle, in radii: accurate to 2e-4 of a radius.
const QUARTER: f32 = 0.551_915;
/// Width of Helvetica's digits as a share of the type size.
const DIGIT_WIDTH: f64 = 0.556;

/// One-page PDF of the sheet. Equal sheets give equal bytes.
///
/// The content is drawn in millimetres under one scale, so a viewer shows the sheet's numbers. The
/// file requests printing without scaling, and some viewers then propose it.
pub fn pdf(sheet: &Sheet) -> Vec<u8> {
    let [catalog, pages, page, regular, bold, content, info] = [1, 2, 3, 4, 5, 6, 7].map(Ref::new);
    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(pages);
    root.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
    root.finish();
    pdf.pages(pages).kids([page]).count(1);
    let points = |mm: f64| (mm * POINTS_PER_MM) as f32;
    let mut only = pdf.page(page);
    only.media_box(Rect::new(0.0, 0.0, points(sheet.width_mm), points(sheet.height_mm)));
    only.parent(pages).contents(content);
    let mut resources = only.resources();
    resources.fonts().pair(Name(b"R"), regular).pair(Name(b"B"), bold);
    resources.finish();
    only.finish();
    pdf.type1_font(regular).base_font(Name(b"Helvetica"));
    pdf.type1_font(bold).base_font(Name(b"Helvetica-Bold"));
    pdf.document_info(info).title(TextStr(&sheet.title)).producer(TextStr("boresight"));
    pdf.stream(content, &drawn(sheet));
    pdf.finish()
}

fn drawn(sheet: &Sheet) -> Vec<u8> {
    let mut content = Content::new();
    let scale = POINTS_PER_MM as f32;
    // Millimetres from the top-left corner, y down.
    content.transform([scale, 0.0, 0.0, -scale, 0.0, (sheet.height_mm * POINTS_PER_MM) as f32]);
    content.set_fill_gray(0.0);
    for black in sheet.squares.iter().chain(&sheet.markers).chain(&sheet.code).chain(&sheet.ruler) {
        let [left, top, width, height] =
            [black.left_mm, black.top_mm, black.width_mm, black.height_mm].map(|mm| mm as f32);
        content.rect(left, top, width, height);
    }
    for disc in &sheet.discs {
        let [x, y] = disc.centre_mm.map(|mm| mm as f32);
        let radius = disc.radius_mm as f32;
        content.move_to(x + radius, y);
        for (cosine, sine) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
            // A quarter turn from (1, 0), rotated into place.
            let at = |along: f32, across: f32| {
                (
                    x + radius * (along * cosine - across * sine),
                    y + radius * (along * sine + across * cosine),
                )
            };
            let ((a, b), (c, d), (e, f)) = (at(1.0, QUARTER), at(QUARTER, 1.0), at(0.0, 1.0));
            content.cubic_to(a, b, c, d, e, f);
        }
        content.close_path();
    }
    content.fill_nonzero();
    content.begin_text();
    for words in &sheet.words {
        let Words { text, x_mm, baseline_mm, size_mm, bold, centred } = words;
        let shift_mm = if *centred { DIGIT_WIDTH * text.len() as f64 * size_mm / 2.0 } else { 0.0 };
        content.set_font(Name(if *bold { b"B" } else { b"R" }), *size_mm as f32);
        // Letters upright although the page's y points down.
        content.set_text_matrix([
            1.0,
            0.0,
            0.0,
            -1.0,
            (x_mm - shift_mm) as f32,
            *baseline_mm as f32,
        ]);
        content.show(Str(text.as_bytes()));
    }
    content.end_text();
    content.finish().to_vec()
}
