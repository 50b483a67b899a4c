// Moves a character by motions of the policy service: requests one that sits down, and sets the
// transforms of its bodies frame by frame, in the axes of Unity (left-handed, y up, z ahead).
//
//   inhabit serve pretrained/sit & (cd examples/csharp && dotnet run 127.0.0.1:50051)
//
// In Unity, assign `Position` and `Rotation` to the Transform of each body: both are local.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading.Tasks;
using Grpc.Core;
using Grpc.Net.Client;
using Rpc.V1;

/// <summary>A body's place in its parent: x, y, z in m, and a quaternion x, y, z, w.</summary>
public sealed class LocalTransform
{
    public double[] Position = { 0, 0, 0 };
    public double[] Rotation = { 0, 0, 0, 1 };

    /// <summary>From x forward, y left, z up to Unity's axes; see docs/how-to/axes.md.</summary>
    public static double[] UnityPosition(IList<double> p)
    {
        return new[] { -p[1], p[2], p[0] };
    }

    public static double[] UnityRotation(double w, double x, double y, double z)
    {
        return new[] { y, -z, -x, w };
    }
}

/// <summary>The character: a transform for each body, set from a frame.</summary>
public sealed class Character
{
    private readonly SynthesisHeader header;
    private readonly Dictionary<string, LocalTransform> bodies;

    public Character(SynthesisHeader header)
    {
        this.header = header;
        bodies = header.Bodies.ToDictionary(
            body => body.Name,
            body => new LocalTransform
            {
                Position = LocalTransform.UnityPosition(body.Offset.Select(v => (double)v).ToList()),
            });
    }

    public LocalTransform this[string body]
    {
        get { return bodies[body]; }
    }

    public void Set(Frame frame)
    {
        LocalTransform root = bodies[header.Bodies.First(body => body.Parent < 0).Name];
        root.Position = LocalTransform.UnityPosition(
            frame.RootPosition.Select(v => (double)v).ToList());
        IList<float> turn = frame.RootRotation;
        root.Rotation = LocalTransform.UnityRotation(turn[0], turn[1], turn[2], turn[3]);
        int at = 0;
        foreach (Joint joint in header.Joints)
        {
            IList<float> q = frame.JointPosition;
            LocalTransform own = bodies[joint.Body];
            if (joint.Kind == "ball")
            {
                own.Rotation = LocalTransform.UnityRotation(q[at], q[at + 1], q[at + 2], q[at + 3]);
                at += 4;
            }
            else
            {
                double half = 0.5 * q[at], s = Math.Sin(half);
                own.Rotation = LocalTransform.UnityRotation(
                    Math.Cos(half), s * joint.Axis[0], s * joint.Axis[1], s * joint.Axis[2]);
                at += 1;
            }
        }
    }
}

public static class Program
{
    public static async Task<int> Main(string[] words)
    {
        string address = words.Length > 0 ? words[0] : "127.0.0.1:50051";
        var request = new SynthesizeRequest
        {
            Task = "sit",
            Furniture = new Furniture { Piece = words.Length > 1 ? words[1] : "chair-test-000" },
            Start = new Start { Standing = new Stance { X = 3.0f, YawRad = (float)Math.PI } },
            Seconds = 10.0,
        };
        using (GrpcChannel channel = GrpcChannel.ForAddress("http://" + address))
        {
            var client = new Policy.PolicyClient(channel);
            Character character = null;
            try
            {
                using (AsyncServerStreamingCall<SynthesizeReply> call = client.Synthesize(request))
                {
                    while (await call.ResponseStream.MoveNext(default(System.Threading.CancellationToken)))
                    {
                        SynthesizeReply reply = call.ResponseStream.Current;
                        if (reply.PartCase == SynthesizeReply.PartOneofCase.Header)
                        {
                            character = new Character(reply.Header);
                        }
                        else if (reply.PartCase == SynthesizeReply.PartOneofCase.Frame)
                        {
                            character.Set(reply.Frame);
                            double[] p = character["pelvis"].Position;
                            Console.WriteLine(
                                "{0:F3} s: pelvis at {1:F4} {2:F4} {3:F4} m",
                                reply.Frame.TimeS, p[0], p[1], p[2]);
                        }
                        else
                        {
                            Console.WriteLine("success: {0}", reply.Summary.Success ? "yes" : "no");
                        }
                    }
                }
            }
            catch (RpcException error)
            {
                Console.Error.WriteLine("MoveCharacter: " + error.Status.Detail);
                return 1;
            }
        }
        return 0;
    }
}
