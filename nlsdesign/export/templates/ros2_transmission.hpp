// A transmission of ros2_control that carries @name@: observer and torque controller of an elastic actuator.
// @description@
//
// Towards the joint it gives the estimated torque of the spring as effort, and position and velocity of the drive at its output;
// from the joint it takes the desired torque as effort. Towards the actuator it reads the position and gives the command as
// effort: @command_unit@ times effort_per_command. One step per write(): run the controller manager at @rate@ Hz.
#ifndef @NAME@_TRANSMISSION_HPP
#define @NAME@_TRANSMISSION_HPP

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "transmission_interface/transmission.hpp"

#include "@name@.h"

namespace @name@_ros2
{
class ElasticTransmission : public transmission_interface::Transmission
{
public:
    // reduction: turns of the actuator's encoder per turn of the drive's output; offset: joint position at encoder zero, in rad.
    explicit ElasticTransmission(double reduction = 1.0, double offset = 0.0, double effort_per_command = 1.0)
    : reduction_(reduction), offset_(offset), effort_per_command_(effort_per_command)
    {
        if (!(std::isfinite(reduction) && reduction != 0.0 && std::isfinite(offset))) {
            throw std::invalid_argument("@name@: mechanical_reduction has to be finite and not zero, offset finite");
        }
        if (!(std::isfinite(effort_per_command) && effort_per_command != 0.0)) {
            throw std::invalid_argument("@name@: effort_per_command has to be finite and not zero");
        }
        (void)@name@_init(&state_, nullptr);
    }

    void configure(
        const std::vector<transmission_interface::JointHandle> &joints,
        const std::vector<transmission_interface::ActuatorHandle> &actuators) override
    {
        joint_position_ = handle_of(joints, "position");
        joint_velocity_ = handle_of(joints, "velocity");
        joint_effort_ = handle_of(joints, "effort");
        actuator_position_ = handle_of(actuators, "position");
        actuator_effort_ = handle_of(actuators, "effort");
        if (!joint_effort_ || !actuator_position_ || !actuator_effort_) {
            throw std::invalid_argument("@name@: needs effort of the joint, position and effort of the actuator");
        }
    }

    // In read(): what the last step has estimated, and the position of this cycle.
    void actuator_to_joint() override
    {
        angle_ = actuator_position_.get_value() / reduction_ + offset_;
        put(joint_position_, angle_);
        put(joint_velocity_, static_cast<double>(@speed@));
        put(joint_effort_, static_cast<double>(outputs_.@estimate@));
    }

    // In write(): one step with the position of this cycle and the torque that is wanted; not a number is a missing reading.
    void joint_to_actuator() override
    {
        @name@_inputs inputs = {};
        inputs.@angle@ = static_cast<@real@>(angle_);
        inputs.@desired@ = static_cast<@real@>(joint_effort_.get_value());
        status_ = @name@_step(&state_, &inputs, &outputs_);
        put(actuator_effort_, effort_per_command_ * static_cast<double>(outputs_.@command@));
    }

    std::size_t num_actuators() const override { return 1; }
    std::size_t num_joints() const override { return 1; }

    // Flags of the last step, see @name@.h. The step never stops the drive: decide in your hardware component what they mean.
    std::uint32_t status() const noexcept { return status_; }
    const @name@_outputs &outputs() const noexcept { return outputs_; }

    // Begins anew with the next usable reading; call it in on_activate().
    void restart() noexcept
    {
        (void)@name@_init(&state_, nullptr);
        outputs_ = @name@_outputs{};
    }

private:
    template <class Handle> static Handle handle_of(const std::vector<Handle> &handles, const std::string &interface)
    {
        for (const Handle &handle : handles) {
            if (handle.get_interface_name() == interface) {
                return handle;
            }
        }
        return Handle("", interface, nullptr);
    }

    template <class Handle> static void put(Handle &handle, double value)
    {
        if (handle) {
            handle.set_value(value);
        }
    }

    double reduction_;
    double offset_;
    double effort_per_command_;
    double angle_ = std::numeric_limits<double>::quiet_NaN();
    std::uint32_t status_ = 0;
    @name@_state state_{};
    @name@_outputs outputs_{};
    transmission_interface::JointHandle joint_position_{"", "position", nullptr};
    transmission_interface::JointHandle joint_velocity_{"", "velocity", nullptr};
    transmission_interface::JointHandle joint_effort_{"", "effort", nullptr};
    transmission_interface::ActuatorHandle actuator_position_{"", "position", nullptr};
    transmission_interface::ActuatorHandle actuator_effort_{"", "effort", nullptr};
};
}  // namespace @name@_ros2

#endif
