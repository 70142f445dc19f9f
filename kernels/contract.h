// What lets one header be a contract: read by GLSL as it stands and by C++ as plain structs.
//
// A contract holds data only: structs (scalar layout, so no padding), policy constants, binding
// numbers and group sizes. Mathematics never stands here: a formula or a mathematical constant
// shared by kernel and model would be wrong in both and seen by nobody.
#ifndef GNOMON_CONTRACT_H
#define GNOMON_CONTRACT_H

#ifdef __cplusplus
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#define GNOMON_CONTRACT(stage) namespace gnomon::stage {
#define GNOMON_CONTRACT_END }
namespace gnomon {
using uint = std::uint32_t;
using glm::ivec2;
using glm::ivec3;
using glm::ivec4;
using glm::mat3;
using glm::mat4;
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
}  // namespace gnomon
#else
#define GNOMON_CONTRACT(stage)
#define GNOMON_CONTRACT_END
#endif

#endif
