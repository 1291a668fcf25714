//! Numbers and structures of `linux/videodev2.h`, named and laid out as bindgen writes them.

use core::ffi::{c_char, c_int, c_long, c_ulong, c_void};

// Numbers.

// Controls.
pub const V4L2_CID_BRIGHTNESS: u32 = 0x0098_0900;
pub const V4L2_CID_CONTRAST: u32 = 0x0098_0901;
pub const V4L2_CID_SATURATION: u32 = 0x0098_0902;
pub const V4L2_CID_HUE: u32 = 0x0098_0903;
pub const V4L2_CID_GAMMA: u32 = 0x0098_0910;
pub const V4L2_CID_EXPOSURE: u32 = 0x0098_0911;
pub const V4L2_CID_GAIN: u32 = 0x0098_0913;
pub const V4L2_CID_WHITE_BALANCE_TEMPERATURE: u32 = 0x0098_091a;
pub const V4L2_CID_SHARPNESS: u32 = 0x0098_091b;
pub const V4L2_CID_BACKLIGHT_COMPENSATION: u32 = 0x0098_091c;
pub const V4L2_CID_PAN_RELATIVE: u32 = 0x009a_0904;
pub const V4L2_CID_TILT_RELATIVE: u32 = 0x009a_0905;
pub const V4L2_CID_FOCUS_RELATIVE: u32 = 0x009a_090b;
pub const V4L2_CID_ZOOM_RELATIVE: u32 = 0x009a_090e;
pub const V4L2_CID_IRIS_RELATIVE: u32 = 0x009a_0912;

// Flags that ask for the next control.
pub const V4L2_CTRL_FLAG_NEXT_CTRL: u32 = 0x8000_0000;
pub const V4L2_CTRL_FLAG_NEXT_COMPOUND: u32 = 0x4000_0000;

/// Order of fields: the driver chooses.
pub const v4l2_field_V4L2_FIELD_ANY: u32 = 0;

/// Stream of images from a camera.
pub const v4l2_buf_type_V4L2_BUF_TYPE_VIDEO_CAPTURE: u32 = 1;

/// Buffers that the driver allocates.
pub const v4l2_memory_V4L2_MEMORY_MMAP: u32 = 1;

// Types of an enumeration of sizes.
pub const v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE: u32 = 1;
pub const v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_CONTINUOUS: u32 = 2;
pub const v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_STEPWISE: u32 = 3;

// Types of an enumeration of intervals.
pub const v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE: u32 = 1;
pub const v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_CONTINUOUS: u32 = 2;
pub const v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_STEPWISE: u32 = 3;

/// Set of video standards.
pub type v4l2_std_id = u64;

/// Seconds or microseconds.
pub type time_t = c_long;

// Structures.

/// Seconds and microseconds.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct timeval {
    pub tv_sec: time_t,
    pub tv_usec: time_t,
}

/// Display identification: `VIDIOC_G_EDID`, `VIDIOC_S_EDID`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_edid {
    pub pad: u32,
    pub start_block: u32,
    pub blocks: u32,
    pub reserved: [u32; 5],
    pub edid: *mut u8,
}

/// Rectangle in pixels.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_rect {
    pub left: i32,
    pub top: i32,
    pub width: u32,
    pub height: u32,
}

/// Fraction, of time or of a pixel's sides.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_fract {
    pub numerator: u32,
    pub denominator: u32,
}

/// What a driver can do: `VIDIOC_QUERYCAP`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_capability {
    pub driver: [u8; 16],
    pub card: [u8; 32],
    pub bus_info: [u8; 32],
    pub version: u32,
    pub capabilities: u32,
    pub device_caps: u32,
    pub reserved: [u32; 3],
}

/// Format of an image in one plane.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_pix_format {
    pub width: u32,
    pub height: u32,
    pub pixelformat: u32,
    pub field: u32,
    pub bytesperline: u32,
    pub sizeimage: u32,
    pub colorspace: u32,
    pub priv_: u32,
    pub flags: u32,
    pub __bindgen_anon_1: v4l2_pix_format__bindgen_ty_1,
    pub quantization: u32,
    pub xfer_func: u32,
}

/// Encoding of colours, by colour space.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_pix_format__bindgen_ty_1 {
    pub ycbcr_enc: u32,
    pub hsv_enc: u32,
}

/// Pixel format that a device offers: `VIDIOC_ENUM_FMT`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_fmtdesc {
    pub index: u32,
    pub type_: u32,
    pub flags: u32,
    pub description: [u8; 32],
    pub pixelformat: u32,
    pub mbus_code: u32,
    pub reserved: [u32; 3],
}

/// One size of frames.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_frmsize_discrete {
    pub width: u32,
    pub height: u32,
}

/// Range of sizes of frames.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_frmsize_stepwise {
    pub min_width: u32,
    pub max_width: u32,
    pub step_width: u32,
    pub min_height: u32,
    pub max_height: u32,
    pub step_height: u32,
}

/// Size that a pixel format offers: `VIDIOC_ENUM_FRAMESIZES`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_frmsizeenum {
    pub index: u32,
    pub pixel_format: u32,
    pub type_: u32,
    pub __bindgen_anon_1: v4l2_frmsizeenum__bindgen_ty_1,
    pub reserved: [u32; 2],
}

/// Size or range, by the type of the enumeration.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_frmsizeenum__bindgen_ty_1 {
    pub discrete: v4l2_frmsize_discrete,
    pub stepwise: v4l2_frmsize_stepwise,
}

/// Range of intervals.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_frmival_stepwise {
    pub min: v4l2_fract,
    pub max: v4l2_fract,
    pub step: v4l2_fract,
}

/// Interval that a size offers: `VIDIOC_ENUM_FRAMEINTERVALS`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_frmivalenum {
    pub index: u32,
    pub pixel_format: u32,
    pub width: u32,
    pub height: u32,
    pub type_: u32,
    pub __bindgen_anon_1: v4l2_frmivalenum__bindgen_ty_1,
    pub reserved: [u32; 2],
}

/// Interval or range, by the type of the enumeration.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_frmivalenum__bindgen_ty_1 {
    pub discrete: v4l2_fract,
    pub stepwise: v4l2_frmival_stepwise,
}

/// Time code of a frame.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_timecode {
    pub type_: u32,
    pub flags: u32,
    pub frames: u8,
    pub seconds: u8,
    pub minutes: u8,
    pub hours: u8,
    pub userbits: [u8; 4],
}

/// Compression of JPEG: `VIDIOC_G_JPEGCOMP`, `VIDIOC_S_JPEGCOMP`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_jpegcompression {
    pub quality: c_int,
    pub APPn: c_int,
    pub APP_len: c_int,
    pub APP_data: [c_char; 60],
    pub COM_len: c_int,
    pub COM_data: [c_char; 60],
    pub jpeg_markers: u32,
}

/// Request for buffers: `VIDIOC_REQBUFS`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_requestbuffers {
    pub count: u32,
    pub type_: u32,
    pub memory: u32,
    pub capabilities: u32,
    pub flags: u8,
    pub reserved: [u8; 3],
}

/// Plane of a buffer with several.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_plane {
    pub bytesused: u32,
    pub length: u32,
    pub m: v4l2_plane__bindgen_ty_1,
    pub data_offset: u32,
    pub reserved: [u32; 11],
}

/// Place of a plane, by the type of memory.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_plane__bindgen_ty_1 {
    pub mem_offset: u32,
    pub userptr: c_ulong,
    pub fd: i32,
}

/// Buffer: `VIDIOC_QUERYBUF`, `VIDIOC_QBUF`, `VIDIOC_DQBUF`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_buffer {
    pub index: u32,
    pub type_: u32,
    pub bytesused: u32,
    pub flags: u32,
    pub field: u32,
    pub timestamp: timeval,
    pub timecode: v4l2_timecode,
    pub sequence: u32,
    pub memory: u32,
    pub m: v4l2_buffer__bindgen_ty_1,
    pub length: u32,
    pub reserved2: u32,
    pub __bindgen_anon_1: v4l2_buffer__bindgen_ty_2,
}

/// Place of a buffer, by the type of memory.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_buffer__bindgen_ty_1 {
    pub offset: u32,
    pub userptr: c_ulong,
    pub planes: *mut v4l2_plane,
    pub fd: i32,
}

/// Request that a buffer belongs to.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_buffer__bindgen_ty_2 {
    pub request_fd: i32,
    pub reserved: u32,
}

/// Buffer as a file: `VIDIOC_EXPBUF`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_exportbuffer {
    pub type_: u32,
    pub index: u32,
    pub plane: u32,
    pub flags: u32,
    pub fd: i32,
    pub reserved: [u32; 11],
}

/// Frame buffer of an overlay: `VIDIOC_G_FBUF`, `VIDIOC_S_FBUF`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_framebuffer {
    pub capability: u32,
    pub flags: u32,
    pub base: *mut c_void,
    pub fmt: v4l2_framebuffer__bindgen_ty_1,
}

/// Format of a frame buffer.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_framebuffer__bindgen_ty_1 {
    pub width: u32,
    pub height: u32,
    pub pixelformat: u32,
    pub field: u32,
    pub bytesperline: u32,
    pub sizeimage: u32,
    pub colorspace: u32,
    pub priv_: u32,
}

/// Clipped part of a window.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_clip {
    pub c: v4l2_rect,
    pub next: *mut v4l2_clip,
}

/// Window of an overlay.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_window {
    pub w: v4l2_rect,
    pub field: u32,
    pub chromakey: u32,
    pub clips: *mut v4l2_clip,
    pub clipcount: u32,
    pub bitmap: *mut c_void,
    pub global_alpha: u8,
}

/// Parameters of capturing.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_captureparm {
    pub capability: u32,
    pub capturemode: u32,
    pub timeperframe: v4l2_fract,
    pub extendedmode: u32,
    pub readbuffers: u32,
    pub reserved: [u32; 4],
}

/// Parameters of output.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_outputparm {
    pub capability: u32,
    pub outputmode: u32,
    pub timeperframe: v4l2_fract,
    pub extendedmode: u32,
    pub writebuffers: u32,
    pub reserved: [u32; 4],
}

/// Limits of cropping: `VIDIOC_CROPCAP`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_cropcap {
    pub type_: u32,
    pub bounds: v4l2_rect,
    pub defrect: v4l2_rect,
    pub pixelaspect: v4l2_fract,
}

/// Cropped part: `VIDIOC_G_CROP`, `VIDIOC_S_CROP`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_crop {
    pub type_: u32,
    pub c: v4l2_rect,
}

/// Video standard: `VIDIOC_ENUMSTD`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_standard {
    pub index: u32,
    pub id: v4l2_std_id,
    pub name: [u8; 24],
    pub frameperiod: v4l2_fract,
    pub framelines: u32,
    pub reserved: [u32; 4],
}

/// Input of a device: `VIDIOC_ENUMINPUT`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_input {
    pub index: u32,
    pub name: [u8; 32],
    pub type_: u32,
    pub audioset: u32,
    pub tuner: u32,
    pub std: v4l2_std_id,
    pub status: u32,
    pub capabilities: u32,
    pub reserved: [u32; 3],
}

/// Output of a device: `VIDIOC_ENUMOUTPUT`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_output {
    pub index: u32,
    pub name: [u8; 32],
    pub type_: u32,
    pub audioset: u32,
    pub modulator: u32,
    pub std: v4l2_std_id,
    pub capabilities: u32,
    pub reserved: [u32; 3],
}

/// Value of a control: `VIDIOC_G_CTRL`, `VIDIOC_S_CTRL`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_control {
    pub id: u32,
    pub value: i32,
}

/// Value of a control of any type.
#[repr(C, packed)]
#[derive(Copy, Clone)]
pub struct v4l2_ext_control {
    pub id: u32,
    pub size: u32,
    pub reserved2: [u32; 1],
    pub __bindgen_anon_1: v4l2_ext_control__bindgen_ty_1,
}

/// The value, by the control's type. The kernel's header has more pointers, to parameters of
/// codecs.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_ext_control__bindgen_ty_1 {
    pub value: i32,
    pub value64: i64,
    pub string: *mut c_char,
    pub p_u8: *mut u8,
    pub p_u16: *mut u16,
    pub p_u32: *mut u32,
    pub ptr: *mut c_void,
}

/// Values of controls: `VIDIOC_G_EXT_CTRLS`, `VIDIOC_S_EXT_CTRLS`, `VIDIOC_TRY_EXT_CTRLS`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_ext_controls {
    pub __bindgen_anon_1: v4l2_ext_controls__bindgen_ty_1,
    pub count: u32,
    pub error_idx: u32,
    pub request_fd: i32,
    pub reserved: [u32; 1],
    pub controls: *mut v4l2_ext_control,
}

/// Which values are meant.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_ext_controls__bindgen_ty_1 {
    pub ctrl_class: u32,
    pub which: u32,
}

/// Description of a control: `VIDIOC_QUERYCTRL`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_queryctrl {
    pub id: u32,
    pub type_: u32,
    pub name: [u8; 32],
    pub minimum: i32,
    pub maximum: i32,
    pub step: i32,
    pub default_value: i32,
    pub flags: u32,
    pub reserved: [u32; 2],
}

/// Description of a control of any type: `VIDIOC_QUERY_EXT_CTRL`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_query_ext_ctrl {
    pub id: u32,
    pub type_: u32,
    pub name: [c_char; 32],
    pub minimum: i64,
    pub maximum: i64,
    pub step: u64,
    pub default_value: i64,
    pub flags: u32,
    pub elem_size: u32,
    pub elems: u32,
    pub nr_of_dims: u32,
    pub dims: [u32; 4],
    pub reserved: [u32; 32],
}

/// Item of a control's menu: `VIDIOC_QUERYMENU`.
#[repr(C, packed)]
#[derive(Copy, Clone)]
pub struct v4l2_querymenu {
    pub id: u32,
    pub index: u32,
    pub __bindgen_anon_1: v4l2_querymenu__bindgen_ty_1,
    pub reserved: u32,
}

/// Name or value of an item, by the control's type.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_querymenu__bindgen_ty_1 {
    pub name: [u8; 32],
    pub value: i64,
}

/// Tuner: `VIDIOC_G_TUNER`, `VIDIOC_S_TUNER`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_tuner {
    pub index: u32,
    pub name: [u8; 32],
    pub type_: u32,
    pub capability: u32,
    pub rangelow: u32,
    pub rangehigh: u32,
    pub rxsubchans: u32,
    pub audmode: u32,
    pub signal: i32,
    pub afc: i32,
    pub reserved: [u32; 4],
}

/// Modulator: `VIDIOC_G_MODULATOR`, `VIDIOC_S_MODULATOR`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_modulator {
    pub index: u32,
    pub name: [u8; 32],
    pub capability: u32,
    pub rangelow: u32,
    pub rangehigh: u32,
    pub txsubchans: u32,
    pub type_: u32,
    pub reserved: [u32; 3],
}

/// Frequency of a tuner: `VIDIOC_G_FREQUENCY`, `VIDIOC_S_FREQUENCY`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_frequency {
    pub tuner: u32,
    pub type_: u32,
    pub frequency: u32,
    pub reserved: [u32; 8],
}

/// Input of sound: `VIDIOC_G_AUDIO`, `VIDIOC_S_AUDIO`, `VIDIOC_ENUMAUDIO`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_audio {
    pub index: u32,
    pub name: [u8; 32],
    pub capability: u32,
    pub mode: u32,
    pub reserved: [u32; 2],
}

/// Output of sound: `VIDIOC_G_AUDOUT`, `VIDIOC_S_AUDOUT`, `VIDIOC_ENUMAUDOUT`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_audioout {
    pub index: u32,
    pub name: [u8; 32],
    pub capability: u32,
    pub mode: u32,
    pub reserved: [u32; 2],
}

/// Entry of an encoder's index.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_enc_idx_entry {
    pub offset: u64,
    pub pts: u64,
    pub length: u32,
    pub flags: u32,
    pub reserved: [u32; 2],
}

/// Index of an encoder: `VIDIOC_G_ENC_INDEX`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_enc_idx {
    pub entries: u32,
    pub entries_cap: u32,
    pub reserved: [u32; 4],
    pub entry: [v4l2_enc_idx_entry; 64],
}

/// Command to an encoder: `VIDIOC_ENCODER_CMD`, `VIDIOC_TRY_ENCODER_CMD`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_encoder_cmd {
    pub cmd: u32,
    pub flags: u32,
    pub __bindgen_anon_1: v4l2_encoder_cmd__bindgen_ty_1,
}

/// Arguments of a command.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_encoder_cmd__bindgen_ty_1 {
    pub raw: v4l2_encoder_cmd__bindgen_ty_1__bindgen_ty_1,
}

/// Arguments as numbers.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_encoder_cmd__bindgen_ty_1__bindgen_ty_1 {
    pub data: [u32; 8],
}

/// Format of raw vertical blanking.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_vbi_format {
    pub sampling_rate: u32,
    pub offset: u32,
    pub samples_per_line: u32,
    pub sample_format: u32,
    pub start: [i32; 2],
    pub count: [u32; 2],
    pub flags: u32,
    pub reserved: [u32; 2],
}

/// Format of sliced vertical blanking.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_sliced_vbi_format {
    pub service_set: u16,
    pub service_lines: [[u16; 24]; 2],
    pub io_size: u32,
    pub reserved: [u32; 2],
}

/// Services of sliced vertical blanking: `VIDIOC_G_SLICED_VBI_CAP`.
#[repr(C)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_sliced_vbi_cap {
    pub service_set: u16,
    pub service_lines: [[u16; 24]; 2],
    pub type_: u32,
    pub reserved: [u32; 3],
}

/// Format of one plane.
#[repr(C, packed)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_plane_pix_format {
    pub sizeimage: u32,
    pub bytesperline: u32,
    pub reserved: [u16; 6],
}

/// Format of an image in several planes.
#[repr(C, packed)]
#[derive(Copy, Clone)]
pub struct v4l2_pix_format_mplane {
    pub width: u32,
    pub height: u32,
    pub pixelformat: u32,
    pub field: u32,
    pub colorspace: u32,
    pub plane_fmt: [v4l2_plane_pix_format; 8],
    pub num_planes: u8,
    pub flags: u8,
    pub __bindgen_anon_1: v4l2_pix_format_mplane__bindgen_ty_1,
    pub quantization: u8,
    pub xfer_func: u8,
    pub reserved: [u8; 7],
}

/// Encoding of colours, by colour space.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_pix_format_mplane__bindgen_ty_1 {
    pub ycbcr_enc: u8,
    pub hsv_enc: u8,
}

/// Format of samples of radio.
#[repr(C, packed)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_sdr_format {
    pub pixelformat: u32,
    pub buffersize: u32,
    pub reserved: [u8; 24],
}

/// Format of metadata.
#[repr(C, packed)]
#[derive(Debug, Copy, Clone)]
pub struct v4l2_meta_format {
    pub dataformat: u32,
    pub buffersize: u32,
}

/// Format of a stream: `VIDIOC_G_FMT`, `VIDIOC_S_FMT`, `VIDIOC_TRY_FMT`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_format {
    pub type_: u32,
    pub fmt: v4l2_format__bindgen_ty_1,
}

/// The format, by the type of the stream.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_format__bindgen_ty_1 {
    pub pix: v4l2_pix_format,
    pub pix_mp: v4l2_pix_format_mplane,
    pub win: v4l2_window,
    pub vbi: v4l2_vbi_format,
    pub sliced: v4l2_sliced_vbi_format,
    pub sdr: v4l2_sdr_format,
    pub meta: v4l2_meta_format,
    pub raw_data: [u8; 200],
}

/// Parameters of a stream: `VIDIOC_G_PARM`, `VIDIOC_S_PARM`.
#[repr(C)]
#[derive(Copy, Clone)]
pub struct v4l2_streamparm {
    pub type_: u32,
    pub parm: v4l2_streamparm__bindgen_ty_1,
}

/// The parameters, by the type of the stream.
#[repr(C)]
#[derive(Copy, Clone)]
pub union v4l2_streamparm__bindgen_ty_1 {
    pub capture: v4l2_captureparm,
    pub output: v4l2_outputparm,
    pub raw_data: [u8; 200],
}
