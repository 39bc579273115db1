// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/png_image.hpp"

#include <fmt/core.h>
#include <png.h>

#include <array>
#include <csetjmp>
#include <cstring>
#include <string>

#include "base/input_file.hpp"

namespace tessera {

namespace {

constexpr std::uint64_t kMostFileBytes = std::uint64_t{64} << 20U;

/// Content of the first chunk of a PNG.
struct Header {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int bits = 0;
  int color = 0;
};

std::uint32_t big_endian(const std::byte* bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8U | std::to_integer<std::uint32_t>(bytes[i]);
  return value;
}

/// The decoder would turn other kinds of pixels into grey; only this distinguishes them.
bool read_header(std::span<const std::byte> file, Header& header) {
  constexpr std::array<unsigned char, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  constexpr std::array<unsigned char, 8> kFirstChunk{0, 0, 0, 13, 'I', 'H', 'D', 'R'};
  constexpr std::size_t kBytes = 26;
  if (file.size() < kBytes || std::memcmp(file.data(), kSignature.data(), kSignature.size()) != 0 ||
      std::memcmp(file.data() + 8, kFirstChunk.data(), kFirstChunk.size()) != 0)
    return false;
  header.width = big_endian(file.data() + 16);
  header.height = big_endian(file.data() + 20);
  header.bits = std::to_integer<int>(file[24]);
  header.color = std::to_integer<int>(file[25]);
  return true;
}

Outcome<std::vector<std::byte>> read_file(std::string_view path) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  if (file.size_bytes() > kMostFileBytes)
    return Failure{std::string(path) +
                   " is larger than 64 MiB; a label image has a byte per pixel"};
  std::vector<std::byte> bytes(static_cast<std::size_t>(file.size_bytes()));
  TESSERA_TRY(file.read_exactly(bytes));
  return bytes;
}

/// Reads by libpng, without any of its conversions.
class Decoder {
 public:
  explicit Decoder(std::span<const std::byte> file)
      : file_(file),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning)) {
    if (png_ == nullptr) return;
    info_ = png_create_info_struct(png_);
    png_set_read_fn(png_, this, read);
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { png_destroy_read_struct(&png_, &info_, nullptr); }

  /// rows: as many as the header says, each as long as it says; libpng may have found another
  /// header. Nothing with a destructor lives in here, as libpng leaves it by a jump.
  bool decode(png_bytepp rows, std::size_t count, std::size_t row_bytes) {
    if (png_ == nullptr || info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    leave_out_all_but_pixels();
    png_read_info(png_, info_);
    if (png_get_image_height(png_, info_) != count || png_get_rowbytes(png_, info_) != row_bytes)
      png_error(png_, "two headers");
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }
  [[nodiscard]] const char* reason() const { return reason_.data(); }

 private:
  /// Text, profiles and palettes are compressed: a file of 2 MB can have 2 GB of them. Only their
  /// checksums are read.
  void leave_out_all_but_pixels() {
    // -1: everything that libpng knows and pixels do not need.
    png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
    png_set_chunk_cache_max(png_, 1);
  }
  [[noreturn]] static void on_error(png_structp png, png_const_charp reason) {
    auto* const self = static_cast<Decoder*>(png_get_error_ptr(png));
    std::strncpy(self->reason_.data(), reason, self->reason_.size() - 1);
    png_longjmp(png, 1);
  }
  static void on_warning(png_structp, png_const_charp) {}
  static void read(png_structp png, png_bytep into, std::size_t count) {
    auto* const self = static_cast<Decoder*>(png_get_io_ptr(png));
    if (count > self->file_.size()) png_error(png, "it ends too early");
    std::memcpy(into, self->file_.data(), count);
    self->file_ = self->file_.subspan(count);
  }

  std::span<const std::byte> file_;
  std::array<char, 80> reason_{"out of memory"};
  png_structp png_;
  png_infop info_ = nullptr;
};

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return fmt::format("{} x {}", width, height);
}

/// The required kind of an image.
struct Wanted {
  int width_px = 0;
  int height_px = 0;
  bool eight = false;
  bool sixteen = false;
};

const char* kind_text(const Wanted& wanted) {
  if (!wanted.sixteen)
    return "an 8-bit grey PNG; write the number of the class as the grey of each pixel";
  if (!wanted.eight) return "a 16-bit grey PNG; write the depth as the grey of each pixel";
  return "an 8- or 16-bit grey PNG; write the id of the class as the grey of each pixel";
}

Outcome<void> check_header(std::string_view path, const Header& header, const Wanted& wanted) {
  const auto width = static_cast<std::uint32_t>(wanted.width_px);
  const auto height = static_cast<std::uint32_t>(wanted.height_px);
  const bool bits = (header.bits == 8 && wanted.eight) || (header.bits == 16 && wanted.sixteen);
  if (!bits || header.color != PNG_COLOR_TYPE_GRAY)
    return Failure{std::string(path) + " is not " + kind_text(wanted)};
  if (header.width != width || header.height != height)
    return Failure{std::string(path) + " has " + size_text(header.width, header.height) +
                   " pixels, but its camera " + size_text(width, height) +
                   "; fix width and height of the camera, or get the images that belong to it"};
  return {};
}

Failure damaged(std::string_view path, const char* reason) {
  return Failure{std::string(path) + " is not an intact PNG (" + one_line(reason) +
                 "); get a complete copy"};
}

Outcome<Header> check_file(std::string_view path, std::span<const std::byte> file,
                           const Wanted& wanted) {
  Header header;
  if (!read_header(file, header)) return damaged(path, "no header");
  TESSERA_TRY(check_header(path, header, wanted));
  return header;
}

/// into: row_bytes for each row.
Outcome<void> decode_rows(std::string_view path, std::span<const std::byte> file,
                          std::size_t row_bytes, std::span<std::uint8_t> into) {
  std::vector<png_bytep> rows(into.size() / row_bytes);
  for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = into.data() + row * row_bytes;
  Decoder decoder(file);
  if (!decoder.decode(rows.data(), rows.size(), row_bytes)) return damaged(path, decoder.reason());
  return {};
}

bool has_room(const Wanted& wanted, std::size_t pixels) {
  return pixels ==
         static_cast<std::size_t>(wanted.width_px) * static_cast<std::size_t>(wanted.height_px);
}

}  // namespace

Outcome<std::vector<std::byte>> encode_png(const PixelsView& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width_px);
  image.height = static_cast<png_uint_32>(picture.height_px);
  image.format = picture.bytes_per_pixel == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t count = bytes.size();
  const int encoded =
      png_image_write_to_memory(&image, bytes.data(), &count, 0, picture.pixels, 0, nullptr);
  const std::string reason = static_cast<const char*>(image.message);
  png_image_free(&image);
  if (encoded == 0) return Failure{"cannot encode the picture: " + reason, FailureKind::kFailure};
  bytes.resize(count);
  return bytes;
}

Outcome<void> read_grey_png(std::string_view path, int width_px, int height_px,
                            std::span<std::uint8_t> out) {
  TESSERA_TRY_ASSIGN(const std::vector<std::byte> file, read_file(path));
  const Wanted wanted{width_px, height_px, true, false};
  if (!has_room(wanted, out.size()))
    return Failure{"no room for the pixels of " + std::string(path), FailureKind::kFailure};
  TESSERA_TRY(check_file(path, file, wanted));
  return decode_rows(path, file, static_cast<std::size_t>(width_px), out);
}

Outcome<void> read_grey_png(std::string_view path, int width_px, int height_px, GreyBits bits,
                            std::span<std::uint16_t> out) {
  TESSERA_TRY_ASSIGN(const std::vector<std::byte> file, read_file(path));
  const Wanted wanted{width_px, height_px, bits == GreyBits::kEightOrSixteen, true};
  if (!has_room(wanted, out.size()))
    return Failure{"no room for the pixels of " + std::string(path), FailureKind::kFailure};
  TESSERA_TRY_ASSIGN(const Header header, check_file(path, file, wanted));
  const std::size_t pixel_bytes = header.bits == 16 ? 2 : 1;
  std::vector<std::uint8_t> bytes(out.size() * pixel_bytes);
  TESSERA_TRY(decode_rows(path, file, static_cast<std::size_t>(width_px) * pixel_bytes, bytes));
  for (std::size_t i = 0; i < out.size(); ++i) {
    // Big-endian in the file.
    const unsigned value =
        pixel_bytes == 1 ? unsigned{bytes[i]} : unsigned{bytes[2 * i]} << 8U | bytes[2 * i + 1];
    out[i] = static_cast<std::uint16_t>(value);
  }
  return {};
}

}  // namespace tessera
