//! QR code of the phone's page, until scanned.

use egui::{
    Align2, Color32, Context, Rect, RichText, Sense, Ui, Vec2, WidgetInfo, accesskit::Role, pos2,
    vec2,
};

use boresight_app::window::services::{PhoneLink, Services};
use boresight_present::text::phone as words;

/// Side of a module.
const MODULE: f32 = 6.0;
/// Distance of the card from the window's edges.
const MARGIN: f32 = 8.0;

/// The card with the code.
pub(super) struct PhoneCard {
    link: Option<PhoneLink>,
    open: bool,
    /// True once a phone has come.
    came: bool,
    /// Number of phones at the last look.
    phones: usize,
}

impl PhoneCard {
    pub(super) fn of(services: &dyn Services) -> Self {
        let link = services.phone();
        Self { open: link.is_some(), link, came: false, phones: 0 }
    }

    /// Notes phones: the link of a connected phone is used up, and the card shows the next link.
    pub(super) fn notice(&mut self, services: &dyn Services, phones: usize) {
        if phones != self.phones {
            (self.phones, self.link) = (phones, services.phone());
        }
    }

    /// Shows the card againor hides the card.
    pub(super) fn button(&mut self, ui: &mut Ui) {
        if self.link.is_some() {
            let toggled =
                ui.selectable_label(self.open, words::PHONE).on_hover_text(words::PHONE_TIP);
            self.open ^= toggled.clicked();
        }
    }

    /// Shows the card. The first new phone in `phones` closes it.
    pub(super) fn show(&mut self, ctx: &Context, phones: usize) {
        let Some(PhoneLink { link, watcher, code }) = &self.link else { return };
        if phones > 0 && !self.came {
            (self.open, self.came) = (false, true);
        }
        // Over the picture, clear of the sentence and the pages.
        let corner = ctx.content_rect().left_bottom() + vec2(MARGIN, -MARGIN);
        egui::Window::new(words::PHONE)
            .pivot(Align2::LEFT_BOTTOM)
            .default_pos(corner)
            .open(&mut self.open)
            .collapsible(false)
            .resizable(false)
            .show(ctx, |ui| {
                ui.label(words::SCAN);
                modules(ui, code, link);
                ui.label(words::TYPE);
                ui.add(egui::Label::new(RichText::new(link).monospace().small()).wrap());
                ui.label(words::WATCH);
                ui.add(egui::Label::new(RichText::new(watcher).monospace().small()).wrap());
                ui.label(words::phones(phones));
            });
    }
}

/// Modules, dark on light under every theme.
fn modules(ui: &mut Ui, code: &[Vec<bool>], link: &str) {
    let side = MODULE * code.len() as f32;
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, Color32::WHITE);
    for (y, row) in code.iter().enumerate() {
        for (x, _) in row.iter().enumerate().filter(|(_, dark)| **dark) {
            let at = rect.min + MODULE * vec2(x as f32, y as f32);
            let module = Rect::from_min_max(at, pos2(at.x + MODULE, at.y + MODULE));
            painter.rect_filled(module, 0.0, Color32::BLACK);
        }
    }
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Image, true, format!("{}: {link}", words::PHONE))
    });
}
