// Where a module keeps what a contract names: whose bindings, which bytes. Ours keep it where the
// contract says; a foreign one where reflection finds it, or where its adapter says.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/program/adapter.h"
#include "harness/program/kernel.h"
#include "harness/program/reflect.h"

namespace gnomon {

/// A buffer of the module: a storage buffer of elements, or a block of parameters.
struct ModuleBuffer {
  std::string name{};
  BindingSlot slot{};
  unsigned stride = 0;  ///< from element to element; 0: a block without a runtime array
  unsigned bytes = 0;   ///< before the first element, or of the whole block
  bool written = false;
};

/// Bytes of a contract's field inside an element, a block or the push constants.
struct Place {
  Field field{};        ///< the contract's
  unsigned buffer = 0;  ///< of Interface::buffers, or kPush
  unsigned offset = 0;  ///< from the start of the buffer's first element, or of the block
  unsigned matrixStride = 0;
  bool rowMajor = false;

  static constexpr unsigned kPush = ~0u;
};

/// A parameter of the module that the contract does not have.
struct Preset {
  unsigned buffer = 0;  ///< or Place::kPush
  unsigned offset = 0;
  std::uint32_t bits = 0;
};

struct ModuleImage {
  std::string name{};  ///< the contract's; empty: a sampler of the module's own
  BindingSlot slot{};
  bool asArray = false;
};

struct Interface {
  std::string entryPoint = "main";
  std::map<std::uint32_t, std::uint32_t> specialization{};  ///< constant id -> 32 bits
  std::array<unsigned, 3> covered{1, 1, 1};  ///< by one group, for records without a grid of theirs
  std::array<unsigned, 3> groupSize{1, 1, 1};
  std::vector<ModuleBuffer> buffers{};
  /// By contract buffer, one for each of its fields in order; none where the module lacks it.
  std::map<std::string, std::vector<std::optional<Place>>> places{};
  /// Of Interface::buffers, by the contract's name of what is scratch; none where the module has it
  /// not.
  std::map<std::string, unsigned> scratch{};
  std::vector<ModuleImage> images{};
  unsigned pushBytes = 0;
  std::vector<Place> push{};  ///< of the contract's push constants that the module has
  std::vector<Preset> presets{};
  /// Push constants that the module does not have, and the one value that it stands for.
  std::map<std::string, double> fixed{};
  std::vector<std::string> unmapped{};  ///< outputs that the module does not give: "results.F"

  const std::vector<std::optional<Place>>& placesOf(const std::string& buffer) const {
    return places.at(buffer);
  }
};

/// Maps a record onto a module. Without an adapter every binding and member must be there by its
/// name, or by its number and offset where the module was stripped of names. Throws UsageError that
/// lists what contradicts, both sides named ("results.F is at byte 16 ...").
Interface interfaceOf(const KernelRecord& record, const Reflection& reflection,
                      const Adapter* adapter, const std::string& origin);

}  // namespace gnomon
