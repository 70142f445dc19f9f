#include "harness/cases/case_file.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "harness/error.h"

namespace gnomon {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kWord = sizeof(std::uint32_t);
constexpr int kSchema = 1;
// kMostNumbers of at most 17 characters with their separators and names, and as much again.
constexpr std::uintmax_t kLargestFile = std::uintmax_t{64} << 20;

// ---- writing --------------------------------------------------------------------------------

std::string quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string floatJson(float x) {
  const std::string text = exactly(x);
  return std::isfinite(x) ? text : quoted(text);
}

std::string scalarJson(ScalarType type, std::uint32_t word) {
  if (type == ScalarType::kUint) return fmt::format("{}", word);
  if (type == ScalarType::kInt) return fmt::format("{}", static_cast<std::int32_t>(word));
  return floatJson(std::bit_cast<float>(word));
}

std::string elementJson(const Struct& layout, std::span<const std::byte> element) {
  std::vector<std::string> fields;
  for (const Field& f : layout.fields) {
    std::vector<std::string> scalars;
    for (unsigned s = 0; s < f.scalars; ++s) {
      std::uint32_t word = 0;
      std::memcpy(&word, element.data() + f.offset + s * kWord, kWord);
      scalars.push_back(scalarJson(f.scalar, word));
    }
    const std::string value = fmt::format("{}", fmt::join(scalars, ", "));
    fields.push_back(quoted(f.name) + ": " + (f.scalars > 1 ? "[" + value + "]" : value));
  }
  return fmt::format("{{{}}}", fmt::join(fields, ", "));
}

std::string blockJson(const CaseInput::Block& block) {
  std::vector<std::string> elements;
  for (std::size_t i = 0; i < block.elements(); ++i)
    elements.push_back("   " + elementJson(block.layout, block.element(i)));
  return fmt::format("{}: [\n{}]", quoted(block.name), fmt::join(elements, ",\n"));
}

std::string imageJson(const CaseInput::Image& image) {
  std::vector<std::string> texels;
  for (const vec4& t : image.picture.texels)
    texels.push_back(fmt::format("    [{}, {}, {}, {}]", floatJson(t.x), floatJson(t.y),
                                 floatJson(t.z), floatJson(t.w)));
  return fmt::format("{}: {{\"size\": [{}, {}], \"ofExtent\": {}, \"texels\": [\n{}]}}",
                     quoted(image.name), image.picture.size.x, image.picture.size.y, image.ofExtent,
                     fmt::join(texels, ",\n"));
}

std::string inputJson(const CaseInput& input) {
  std::vector<std::string> parts;
  if (input.push)
    parts.push_back("  \"push\": " + elementJson(input.push->layout, input.push->bytes));
  std::vector<std::string> buffers, images;
  for (const auto& b : input.buffers) buffers.push_back("  " + blockJson(b));
  for (const auto& i : input.images) images.push_back("  " + imageJson(i));
  if (!buffers.empty())
    parts.push_back(fmt::format("  \"buffers\": {{\n{}}}", fmt::join(buffers, ",\n")));
  if (!images.empty())
    parts.push_back(fmt::format("  \"images\": {{\n{}}}", fmt::join(images, ",\n")));
  return fmt::format("{{\n{}}}", fmt::join(parts, ",\n"));
}

// ---- reading --------------------------------------------------------------------------------

/// What is wrong and where; the file's name is put before it.
[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw UsageError(fmt::format("{}: {}", where, what));
}

const Json& member(const Json& object, const std::string& key, const std::string& where) {
  if (!object.is_object()) refuse(where, "is not an object");
  const auto found = object.find(key);
  if (found == object.end()) refuse(where, fmt::format("has no \"{}\"", key));
  return *found;
}

std::string textAt(const Json& object, const char* key) {
  const Json& j = member(object, key, "the file");
  if (!j.is_string()) refuse(key, "is not text");
  return j.get<std::string>();
}

std::uint64_t countAt(const Json& object, const char* key, const std::string& where) {
  const Json& j = member(object, key, where);
  if (!j.is_number_unsigned()) refuse(fmt::format("{}.{}", where, key), "is not a whole number");
  return j.get<std::uint64_t>();
}

float specialFloat(const std::string& text, const std::string& where) {
  if (text == "Infinity") return std::numeric_limits<float>::infinity();
  if (text == "-Infinity") return -std::numeric_limits<float>::infinity();
  constexpr std::string_view kNan = "NaN 0x";
  std::uint32_t bits = 0;
  if (text.starts_with(kNan) && text.size() == kNan.size() + 8) {
    const auto [end, error] =
        std::from_chars(text.data() + kNan.size(), text.data() + text.size(), bits, 16);
    if (error == std::errc() && end == text.data() + text.size() &&
        std::isnan(std::bit_cast<float>(bits)))
      return std::bit_cast<float>(bits);
  }
  refuse(where, fmt::format("'{}' is no float; give a number, Infinity, -Infinity or \"NaN "
                            "0x7fc00000\"",
                            text.substr(0, 40)));
}

std::uint32_t floatWord(const Json& j, const std::string& where) {
  if (j.is_string()) return std::bit_cast<std::uint32_t>(specialFloat(j, where));
  if (!j.is_number()) refuse(where, "is not a number");
  const double x = j.get<double>();
  // What rounds to no float is no float: half a step above the largest one.
  if (!(std::abs(x) < 0x1.ffffffp127)) refuse(where, fmt::format("{} is beyond all floats", x));
  return std::bit_cast<std::uint32_t>(static_cast<float>(x));
}

std::uint32_t scalarWord(ScalarType type, const Json& j, const std::string& where) {
  if (type == ScalarType::kFloat) return floatWord(j, where);
  if (!j.is_number_integer()) refuse(where, "is not a whole number");
  const bool negative = !j.is_number_unsigned() && j.get<std::int64_t>() < 0;
  if (type == ScalarType::kUint) {
    if (negative || j.get<std::uint64_t>() > std::numeric_limits<std::uint32_t>::max())
      refuse(where, "is no 32-bit unsigned integer");
    return j.get<std::uint32_t>();
  }
  if (negative ? j.get<std::int64_t>() < std::numeric_limits<std::int32_t>::min()
               : j.get<std::uint64_t>() > std::numeric_limits<std::int32_t>::max())
    refuse(where, "is no 32-bit integer");
  return static_cast<std::uint32_t>(j.get<std::int32_t>());
}

void requireKeys(const Json& object, const std::vector<std::string>& known,
                 const std::string& where) {
  if (!object.is_object()) refuse(where, "is not an object");
  for (const auto& [key, unused] : object.items())
    if (std::ranges::find(known, key) == known.end())
      refuse(where,
             fmt::format("has no \"{}\"; there are {}", key.substr(0, 40), fmt::join(known, ", ")));
}

void readElement(const Json& j, const Struct& layout, std::span<std::byte> element,
                 const std::string& where) {
  std::vector<std::string> names;
  for (const Field& f : layout.fields) names.push_back(f.name);
  requireKeys(j, names, where);
  for (const Field& f : layout.fields) {
    const std::string place = where + "." + f.name;
    const Json& value = member(j, f.name, where);
    const bool list = f.scalars > 1;
    if (list && (!value.is_array() || value.size() != f.scalars))
      refuse(place, fmt::format("is not a list of {} numbers", f.scalars));
    for (unsigned s = 0; s < f.scalars; ++s) {
      const std::uint32_t word = scalarWord(f.scalar, list ? value[s] : value, place);
      std::memcpy(element.data() + f.offset + s * kWord, &word, kWord);
    }
  }
}

CaseInput::Block readBlock(const Json& j, const std::string& name, const Struct& layout) {
  if (!j.is_array()) refuse(name, "is not a list of elements");
  CaseInput::Block block{name, layout, Bytes(j.size() * layout.size)};
  for (std::size_t i = 0; i < j.size(); ++i)
    readElement(j[i], layout, block.element(i), fmt::format("{}[{}]", name, i));
  return block;
}

CaseInput::Image readImage(const Json& j, const std::string& name) {
  requireKeys(j, {"size", "ofExtent", "texels"}, name);
  const Json& size = member(j, "size", name);
  const Json& texels = member(j, "texels", name);
  const Json& ofExtent = member(j, "ofExtent", name);
  if (!ofExtent.is_boolean()) refuse(name + ".ofExtent", "is neither true nor false");
  if (!size.is_array() || size.size() != 2) refuse(name + ".size", "is not a list of 2 numbers");
  const std::uint32_t width = scalarWord(ScalarType::kUint, size[0], name + ".size"),
                      height = scalarWord(ScalarType::kUint, size[1], name + ".size");
  if (!texels.is_array() || texels.empty() ||
      std::uint64_t{width} * height != std::uint64_t{texels.size()})
    refuse(name + ".texels", fmt::format("is not a list of {} x {} texels", width, height));
  CaseInput::Image image{name, {.size = {width, height}, .texels = {}}, ofExtent};
  for (std::size_t t = 0; t < texels.size(); ++t) {
    const std::string where = fmt::format("{}.texels[{}]", name, t);
    if (!texels[t].is_array() || texels[t].size() != 4) refuse(where, "is not a list of 4 numbers");
    vec4 texel;
    for (std::size_t c = 0; c < 4; ++c)
      texel[static_cast<int>(c)] = std::bit_cast<float>(floatWord(texels[t][c], where));
    image.picture.texels.push_back(texel);
  }
  return image;
}

/// In the order of the contract, which is the one that the case names its parts in.
CaseInput readInput(const Json& j, const KernelRecord& record) {
  requireKeys(j, {"push", "buffers", "images"}, "input");
  CaseInput input;
  if (j.contains("push")) {
    input.push = {"push", record.push, Bytes(record.push.size)};
    readElement(j["push"], record.push, input.push->bytes, "push");
  }
  const Json none = Json::object();
  const Json& buffers = j.contains("buffers") ? j["buffers"] : none;
  const Json& images = j.contains("images") ? j["images"] : none;
  std::vector<std::string> names;
  for (const BufferSpec& b : record.buffers) names.push_back(b.name);
  requireKeys(buffers, names, "buffers");
  for (const BufferSpec& b : record.buffers)
    if (buffers.contains(b.name))
      input.buffers.push_back(readBlock(buffers[b.name], b.name, b.element));
  names.clear();
  for (const ImageSpec& i : record.images) names.push_back(i.name);
  requireKeys(images, names, "images");
  for (const ImageSpec& i : record.images)
    if (images.contains(i.name)) input.images.push_back(readImage(images[i.name], i.name));
  return input;
}

Json parsed(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) throw UsageError("there is no such file");
  if (fs::file_size(file, error) > kLargestFile || error)
    throw UsageError("it is larger than any that gnomon writes");
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.good() && !in.eof()) throw UsageError("it cannot be read");
  Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) throw UsageError("it is not JSON, or not an object");
  return json;
}

}  // namespace

std::string caseFileJson(const CaseFile& f) {
  return fmt::format(
      "{{\n \"schema\": {},\n \"case\": {},\n \"kernel\": {},\n \"seed\": {},\n \"device\": {},\n"
      " \"output\": {},\n \"field\": {},\n \"judgement\": {},\n \"input\": {}}}\n",
      kSchema, quoted(f.name), quoted(f.kernel), f.seed, quoted(f.device), quoted(f.output),
      quoted(f.field), f.judgement, inputJson(f.input));
}

CaseFile readCaseFile(const fs::path& file) try {
  const Json j = parsed(file);
  if (const auto schema = j.find("schema"); schema == j.end() || *schema != kSchema)
    throw UsageError(fmt::format("its \"schema\" is not {}, the only one known", kSchema));
  requireKeys(
      j, {"schema", "case", "kernel", "seed", "device", "output", "field", "judgement", "input"},
      "the file");
  CaseFile f{.name = textAt(j, "case"),
             .kernel = textAt(j, "kernel"),
             .seed = countAt(j, "seed", "the file"),
             .device = textAt(j, "device"),
             .output = textAt(j, "output"),
             .field = textAt(j, "field"),
             .judgement = countAt(j, "judgement", "the file")};
  f.input = readInput(member(j, "input", "the file"), findKernel(f.kernel));
  return f;
} catch (const UsageError& e) {
  throw UsageError(fmt::format(
      "{}: not an input that can be replayed: {}.\n`gnomon validate` writes such a file for each "
      "case that fails and says where",
      file.string(), e.what()));
}

bool writeCaseFile(const fs::path& file, const CaseFile& content) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  const fs::path draft = fmt::format("{}.{}", file.string(), getpid());
  std::ofstream out(draft, std::ios::binary);
  out << caseFileJson(content);
  out.close();
  const bool written = static_cast<bool>(out);
  if (written) fs::rename(draft, file, error);
  if (!written || error) fs::remove(draft, error);
  return written && fs::is_regular_file(file, error);
}

fs::path caseFileIn(const fs::path& folder, const std::string& name) {
  std::string plain = name;
  std::ranges::replace(plain, '/', '_');
  return folder / (plain + ".json");
}

fs::path failuresCache() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return fs::path(cache) / "gnomon/failures";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return fs::path(home) / ".cache/gnomon/failures";
  return {};
}

}  // namespace gnomon
