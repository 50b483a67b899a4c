// Moves a character by motions of the policy service: requests one that sits down, and sets the
// transforms of its bodies frame by frame, as an engine does.
//
//   inhabit serve pretrained/sit & build/move_character 127.0.0.1:50051 [PIECE] [SECONDS]
//
// Metres, z up, quaternions w, x, y, z; docs/how-to/axes.md has the axes of engines.
#include <grpcpp/grpcpp.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "rpc/v1/policy.grpc.pb.h"

namespace pb = rpc::v1;

using Vector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  // w, x, y, z

struct Transform {
  Vector position;
  Quaternion rotation;
};

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

Vector turned(const Quaternion& q, const Vector& v) {
  const Quaternion moved =
      product(product(q, {0, v[0], v[1], v[2]}), {q[0], -q[1], -q[2], -q[3]});
  return {moved[1], moved[2], moved[3]};
}

// The character: one transform for each body, set from a frame by forward kinematics.
class Character {
 public:
  explicit Character(const pb::SynthesisHeader& header)
      : header_(header), transforms_(header.bodies_size()) {}

  void set(const pb::Frame& frame) {
    std::vector<Quaternion> local(header_.bodies_size(), Quaternion{1, 0, 0, 0});
    int at = 0;
    for (const pb::Joint& joint : header_.joints()) {
      Quaternion& own = local[index(joint.body())];
      if (joint.kind() == "ball") {
        for (int k = 0; k < 4; ++k) own[k] = frame.joint_position(at++);
      } else {
        const double half = 0.5 * frame.joint_position(at++);
        own[0] = std::cos(half);
        for (int k = 0; k < 3; ++k) own[k + 1] = std::sin(half) * joint.axis(k);
      }
    }
    // parents come before their children
    for (int body = 0; body < header_.bodies_size(); ++body) {
      const pb::Body& part = header_.bodies(body);
      Transform& now = transforms_[body];
      if (part.parent() < 0) {
        for (int k = 0; k < 3; ++k) now.position[k] = frame.root_position(k);
        for (int k = 0; k < 4; ++k) now.rotation[k] = frame.root_rotation(k);
        continue;
      }
      const Transform& above = transforms_[part.parent()];
      const Vector away =
          turned(above.rotation, {part.offset(0), part.offset(1), part.offset(2)});
      for (int k = 0; k < 3; ++k) now.position[k] = above.position[k] + away[k];
      now.rotation = product(above.rotation, local[body]);
    }
  }

  const Transform& operator[](const std::string& body) const { return transforms_[index(body)]; }

 private:
  int index(const std::string& body) const {
    for (int k = 0; k < header_.bodies_size(); ++k)
      if (header_.bodies(k).name() == body) return k;
    std::fprintf(stderr, "the service has no body %s\n", body.c_str());
    std::exit(1);
  }

  const pb::SynthesisHeader header_;
  std::vector<Transform> transforms_;
};

int main(int count, char** words) {
  const std::string address = count > 1 ? words[1] : "127.0.0.1:50051";
  pb::SynthesizeRequest request;
  request.set_task("sit");
  request.mutable_furniture()->set_piece(count > 2 ? words[2] : "chair-test-000");
  request.set_seconds(count > 3 ? std::atof(words[3]) : 10.0);
  pb::Stance* stance = request.mutable_start()->mutable_standing();
  stance->set_x(3.0f);
  stance->set_yaw_rad(static_cast<float>(M_PI));

  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // a proxy does not reach this machine
  const auto stub = pb::Policy::NewStub(
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  const auto replies = stub->Synthesize(&context, request);
  std::vector<Character> character;  // none before the header
  pb::SynthesizeReply reply;
  int frames = 0;
  while (replies->Read(&reply)) {
    if (reply.has_header()) character.emplace_back(reply.header());
    if (!reply.has_frame()) continue;
    character.front().set(reply.frame());
    ++frames;
    const Vector& head = character.front()["head"].position;
    std::printf("%.3f s: head at %.4f %.4f %.4f m\n", reply.frame().time_s(), head[0], head[1],
                head[2]);
  }
  const grpc::Status status = replies->Finish();
  if (!status.ok()) {
    std::fprintf(stderr, "move_character: %s\n", status.error_message().c_str());
    return 1;
  }
  std::printf("%d frames; success: %s\n", frames, reply.summary().success() ? "yes" : "no");
  return 0;
}
