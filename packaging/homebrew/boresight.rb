# Formula for a tap. packaging/manifests.py fills in version and sum.
class Boresight < Formula
  desc "Guided camera calibration with honest uncertainty"
  homepage "@HOMEPAGE@"
  url "@HOMEPAGE@/archive/refs/tags/v@VERSION@.tar.gz"
  sha256 "@SOURCE_SHA256@"
  license any_of: ["MIT", "Apache-2.0"]

  depends_on "rust" => :build

  def install
    ENV["BORESIGHT_COMMIT"] = "v#{version}"
    system "cargo", "install", *std_cargo_args
    generate_completions_from_executable(bin/"boresight", "completions")
    system bin/"boresight", "man", man1
  end

  test do
    assert_match version.to_s, shell_output("#{bin}/boresight --version")
    system bin/"boresight", "demo", "--fast", "--no-open", "--out", testpath/"demo"
    assert_path_exists testpath/"demo/calibration.json"
  end
end
