#!/usr/bin/python3
"""Serves an MP4 file (MPEG-4 part 2) over RTSP with GStreamer's server, at /camera.

    rtsp_server.py FILE USER PASSWORD

Prints its port and runs until it's killed. Debian: gir1.2-gst-rtsp-server-1.0, python3-gi, gstreamer1.0-plugins-good.
"""

import sys

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

Gst.init(None)
path, user, password = sys.argv[1:4]

factory = GstRtspServer.RTSPMediaFactory.new()
factory.set_shared(True)
factory.set_launch(f"( filesrc location={path} ! qtdemux ! rtpmp4vpay name=pay0 config-interval=1 )")
permissions = GstRtspServer.RTSPPermissions()
permissions.add_role("viewer")
for what in ("media.factory.access", "media.factory.construct"):
    permissions.add_permission_for_role("viewer", what, True)
factory.set_permissions(permissions)

token = GstRtspServer.RTSPToken()
token.set_string("media.factory.role", "viewer")
access = GstRtspServer.RTSPAuth.new()
access.add_basic(GstRtspServer.RTSPAuth.make_basic(user, password), token)

server = GstRtspServer.RTSPServer.new()
server.set_address("127.0.0.1")
server.set_service("0")
server.set_auth(access)
server.get_mount_points().add_factory("/camera", factory)
server.attach(None)
print(server.get_bound_port(), flush=True)
GLib.MainLoop().run()
